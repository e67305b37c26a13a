/* How luminaires, media and the scattering of blocks lie in the buffer `lighting`: words, in records of a fixed size,
 * at offsets that PictureConstants names. Floats are stored as their bits.
 *
 *   luminaires  kLuminaireWords each, in the order of TraceScene::luminaires
 *   everywhere  numbers of the luminaires that light all places
 *   cells       a hash table of cubes of 2^shift voxels, kCellWords each: place, and the list of what reaches it
 *   lists       numbers of luminaires
 *   blocks      kBlockWords each: BsdfParameters
 *   parts       kPartWords for each triangle of a mesh
 *   images      3 words a pixel; of a sky, its sums of rows, of columns, and cosines of the rows' borders
 *   densities   bricks of 8^3 samples, and a table of them over the grid's leaves */
#ifndef LOAM_RENDER_RASTER_LIGHTING_SHARED_H
#define LOAM_RENDER_RASTER_LIGHTING_SHARED_H
#include "world/base/shared.h"

#ifdef __cplusplus
namespace render::raster {
using glsl::uint;
#endif

/* A luminaire. */
SHARED_CONST uint kLuminaireWords = 36u;
SHARED_CONST uint kLumKind = 0u;     /* LUMINAIRE_...; flags above bit 8 */
SHARED_CONST uint kLumVoxel = 1u;    /* ivec3 */
SHARED_CONST uint kLumFraction = 4u; /* vec3, m */
SHARED_CONST uint kLumAxis = 7u;     /* vec3 */
SHARED_CONST uint kLumUp = 10u;      /* vec3 */
SHARED_CONST uint kLumColour = 13u;  /* vec3 */
SHARED_CONST uint kLumExtent = 16u;  /* vec2 */
SHARED_CONST uint kLumRadius = 18u;
SHARED_CONST uint kLumCone = 19u;        /* cone, inner cone */
SHARED_CONST uint kLumTangent = 21u;     /* of half the slide's angle */
SHARED_CONST uint kLumAttenuation = 22u; /* vec3 */
SHARED_CONST uint kLumReach = 25u;       /* m; what is farther is too weakly lit to count */
SHARED_CONST uint kLumImage = 26u;       /* offset of its pixels */
SHARED_CONST uint kLumImageSize = 27u;   /* width | height << 16 */
SHARED_CONST uint kLumTables = 28u;      /* of a sky: offset of its sums of rows */
SHARED_CONST uint kLumParts = 29u;       /* of a mesh: offset of its parts */
SHARED_CONST uint kLumPartCount = 30u;
SHARED_CONST uint kLumArea = 31u;    /* m^2, of a mesh */
SHARED_CONST uint kLumMap = 32u;     /* 1 + offset of its shadow map; 0: none */
SHARED_CONST uint kLumMapSize = 33u; /* texels a side */

/* Beside the kinds of luminaires that there are: some have an image, which is a slide, or a sky. */
SHARED_CONST uint kLuminaireSlides = 0x40000000u, kLuminaireSkies = 0x80000000u;
SHARED_CONST uint kLumImpulse = 0x100u;  /* flags */
SHARED_CONST uint kLumFinite = 0x200u;   /* has a place */
SHARED_CONST uint kLumSlide = 0x400u;    /* its image is a slide */
SHARED_CONST uint kLumSky = 0x800u;      /* its image is a sky */
SHARED_CONST uint kLumWhole = 0x1000u;   /* whole_sphere */
SHARED_CONST uint kLumUniform = 0x2000u; /* uniform_area */
SHARED_CONST uint kLumAtInfinity = 0x4000u;
SHARED_CONST uint kLumMesh = 0x8000u;
SHARED_CONST uint kLumNoMatte = 0x10000u; /* switches that take it out of physics */
SHARED_CONST uint kLumNoGloss = 0x20000u;
SHARED_CONST uint kLumNoShadow = 0x40000u;

SHARED_CONST uint kCellWords = 5u;  /* x, y, z of the cell, offset of its list (0: free), its length */
SHARED_CONST uint kPartWords = 10u; /* corner, two edges, running sum of areas */

/* A medium, in texels of four words of a buffer of its own: software reads such a texel as fast as one word of
 * `lighting`. */
SHARED_CONST uint kMediumTexels = 7u;
SHARED_CONST uint kMedVoxel = 0u;      /* ivec3; MEDIUM_..., or kMediumDensityGrid */
SHARED_CONST uint kMedFraction = 1u;   /* vec3; scale height, or voxel size of a grid */
SHARED_CONST uint kMedExtinction = 2u; /* vec3, 1/m; anisotropy */
SHARED_CONST uint kMedEmission = 3u;   /* vec3, with what is scattered in of the sky; offset of a grid's table */
SHARED_CONST uint kMedInSun = 4u;      /* vec3: fog_light.h; 1 where a grid is sampled trilinearly */
SHARED_CONST uint kMedHalfExtent = 5u; /* vec3; of a grid its low bound, in its voxels */
SHARED_CONST uint kMedNormal = 6u;     /* vec3; of a grid its high bound */
/* That table, in `lighting`: low corner and size in leaves, then the offset of a brick a leaf. */
SHARED_CONST uint kMediumLeavesHead = 6u;
SHARED_CONST uint kMediumDensityGrid = 31u; /* beyond all MEDIUM_... */

/* BsdfParameters of a block seen from air. */
SHARED_CONST uint kBlockWords = 16u;
SHARED_CONST uint kBlockBsdf = 0u;       /* BSDF_... | kBlockFinite */
SHARED_CONST uint kBlockLambertian = 1u; /* vec3; of what scatters by impulses alone all of it */
SHARED_CONST uint kBlockSmoothness = 4u;
SHARED_CONST uint kBlockGlossy = 5u; /* vec3 */
SHARED_CONST uint kBlockEta = 8u;
SHARED_CONST uint kBlockTransmission = 9u; /* vec3 */
SHARED_CONST uint kBlockCoverage = 12u;
SHARED_CONST uint kBlockGloss = 13u;
SHARED_CONST uint kBlockFinite = 0x100u; /* scatters not by impulses alone */

/* Shadows of luminaires, in the order of the knob's choices. */
SHARED_CONST uint kLuminaireShadowNone = 0u, kLuminaireShadowMap = 1u, kLuminaireShadowRay = 2u;

/* Tiles of the picture whose lists say which luminaires are seen in them. */
SHARED_CONST uint kSeenTile = 16u;

#ifdef __cplusplus
}  // namespace render::raster
#endif
#endif
