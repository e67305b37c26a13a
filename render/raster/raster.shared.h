// What the processor and the shaders of the rasterizer both need: bindings, the constants of a picture, the face
// record.
#ifndef LOAM_RENDER_RASTER_RASTER_SHARED_H
#define LOAM_RENDER_RASTER_RASTER_SHARED_H

#include "world/base/shared.h"
#include "world/scenes/clouds.shared.h"
#include "world/scenes/sky_model.shared.h"

#ifdef __cplusplus
namespace render::raster {
using glsl::ivec4, glsl::uint, glsl::uvec4, glsl::vec4;
using world::shared::CloudLayer, world::shared::SkyModel;
#endif

// Numbers of bindings, one for each buffer and image of the whole backend. A shader declares those that it uses, and
// its pipeline's layout is read from it; so numbers may have gaps. 0..31 geometry and its shading.
SHARED_CONST uint kBindPicture = 0;    // uniform PictureConstants
SHARED_CONST uint kBindFaces = 1;      // uvec2 texels: face records
SHARED_CONST uint kBindChunks = 2;     // ivec4 texels: corner of each chunk, relative to the camera's voxel
SHARED_CONST uint kBindMaterials = 3;  // uvec4 texels: two a block, shading/picture.glsl.h
SHARED_CONST uint kBindSeen = 4;       // texture  what each pixel sees
SHARED_CONST uint kBindRadiance = 5;   // float[3 * pixels]
SHARED_CONST uint kBindRegions = 6;    // ivec4 texels: shadow grid: hash table, region position and place + 1; 0: free
SHARED_CONST uint kBindLeaves = 7;     // uint texels: shadow grid: 16^3 a region, kLeaf...
SHARED_CONST uint kBindMasks = 8;      // uint texels: shadow grid: 16 a mixed leaf, 4x2x4 voxels each
SHARED_CONST uint kBindDepth = 9;      // texture  depth of what is drawn so far
SHARED_CONST uint kBindTiles = 10;     // float[], or texels: farthest depth of each tile of pixels
SHARED_CONST uint kBindCandidates = 11;  // uvec4 texels: four a cluster that the occlusion test looks at: Candidate of
                                         // culling.h
SHARED_CONST uint kBindDraws = 12;       // uint[]   indirect draws
SHARED_CONST uint kBindVisible = 13;     // uint[4n]  of each candidate's records which may be seen, a bit each
SHARED_CONST uint kBindLightRegions = 14;  // ivec4 texels: light on faces: hash table, as kBindRegions
SHARED_CONST uint kBindLightLeafOf = 15;   // uint texels: 4096 a region: 1 + place of the leaf's record; 0: no face
SHARED_CONST uint kBindLightLeaves = 16;   // uint texels: kLightLeafWords a leaf, SurfaceLightLeaf
SHARED_CONST uint kBindLightCodes = 17;    // uint texels: a visible face
SHARED_CONST uint kBindSunMap = 18;      // float texels  depths of the sun's map, row by row; or sun_cascades.shared.h
SHARED_CONST uint kBindColour = 19;      // image    linear radiance: targets.colour
SHARED_CONST uint kBindShapeQuads = 20;  // vec4 texels: kQuadVectors each, faces of shapes, see shading/shape.glsl.h
SHARED_CONST uint kBindShapeLit =
    21;  // vec4 texels: two by `lit` of a quad: radiance of albedo 1 under the sky, in the sun
SHARED_CONST uint kBindSunHeights = 22;        // uint texels: sun_heights.h
SHARED_CONST uint kBindPutOff = 23;            // uint[]   pixels that shading puts off
SHARED_CONST uint kBindPutOffDispatch = 24;    // uint[]   the dispatches over them: ListHead, slices
SHARED_CONST uint kBindMeshes = 25;            // uvec4 texels: triangles.h, see below
SHARED_CONST uint kBindSkyTable = 26;          // vec4 texels: irradiance by normal, of a sky of a time of day
SHARED_CONST uint kBindImpostorRows = 27;      // uvec2[]  first and last row of each strip that is made
SHARED_CONST uint kBindImpostorSeen = 28;      // texture  seen of what impostors are made of
SHARED_CONST uint kBindImpostorDepth = 29;     // texture  its depth
SHARED_CONST uint kBindImpostorTexels = 30;    // uvec2[], or texels: impostors.shared.h
SHARED_CONST uint kBindImpostors = 31;         // ImpostorDraw[] those that are drawn
SHARED_CONST uint kBindBalls = 96;             // DrawnBall[] particles, from far to near
SHARED_CONST uint kBindBoxes = 97;             // DrawnBox[]  bodies
SHARED_CONST uint kBindHistory = 98;           // vec4[]   what the pictures before saw of each pixel
SHARED_CONST uint kBindNewHistory = 99;        // vec4[]   with this picture
SHARED_CONST uint kBindBillboardPlanes = 100;  // BillboardPlane[] billboards.shared.h
SHARED_CONST uint kBindBillboardDraws = 101;   // BillboardDraw[]  those that are drawn
SHARED_CONST uint kBindBillboardTexels = 102;  // uint texels: billboard_cloud.h
SHARED_CONST uint kBindHeightWords = 103;      // uint texels: height_surface.h
SHARED_CONST uint kBindHeightDraws = 104;      // HeightDraw[] those that are drawn
// 32..63: light and sky. 64..95: transparency, water, reflections. 96..127: particles, the whole picture.
SHARED_CONST uint kBindLighting = 32;        // uint texels  luminaires, media, blocks: lighting.shared.h
SHARED_CONST uint kBindSeenLuminaires = 33;  // uint texels  by tile of the picture: offset and length, then the lists
SHARED_CONST uint kBindFaceLit = 34;  // vec4 texels: six by face under the sky, six in the sun: shading/picture.glsl.h
SHARED_CONST uint kBindTexels = 35;   // vec4 texels, a byte each: render/textures/texture.shared.h
SHARED_CONST uint kBindBlockerRegions = 36;  // ivec4 texels  of what dims or hides the sun and isn't opaque: hash table
SHARED_CONST uint kBindBlockerLeaves = 37;   // uint texels  as kBindBlockLeaves
SHARED_CONST uint kBindBlockerCodes = 38;    // uint texels  as kBindBlockIds: see-through block, or kShapeCode
SHARED_CONST uint kBindBlockerKinds = 39;    // ivec4 low region, w: slots less 1; high region; SeeThroughBlock[]
SHARED_CONST uint kBindMirrorStrips = 40;    // vec4[]   mirror_stencil_pass.h: relative to the camera
SHARED_CONST uint kBindListedFaces = 41;     // uvec2[], or texels: face_blocks.shared.h, as those at 47..54
SHARED_CONST uint kBindSecondIndices = 42;   // uint[]   six a face that the second pass draws
SHARED_CONST uint kBindDrawCounts = 43;      // uint[]   by page: draws of the second pass that draw anything
SHARED_CONST uint kBindVoxelLeaves = 44;     // ivec4 texels: light around triangles: hash table of leaves and place + 1
SHARED_CONST uint kBindVoxelCodes = 45;      // uint texels: 512 a leaf, or six times that: triangle_light.h
SHARED_CONST uint kBindMedia = 46;           // uvec4 texels: kMediumTexels a medium: lighting.shared.h
SHARED_CONST uint kBindFaceSetups = 47;      // uvec4[], or texels: kSetupTexels a listed face
SHARED_CONST uint kBindBlockFaces = 48;      // uint[], or texels: listed faces of each block
SHARED_CONST uint kBindBlockCounts = 49;     // uint[], or texels: how many
SHARED_CONST uint kBindFaceItems = 50;       // uvec2[], or texels: listed face, bin
SHARED_CONST uint kBindFaceHeads = 51;       // uint[]   how long these lists are, and the dispatches over them
SHARED_CONST uint kBindActiveBlocks = 52;    // uint[], or texels: x | y << 16 of those with a list
SHARED_CONST uint kBindBlockDepths = 53;     // vec4[]   of four pixels; rows of whole blocks
SHARED_CONST uint kBindSeenRows = 54;        // uvec4[]  seen_image: two pixels
SHARED_CONST uint kBindListedShapes = 55;    // uvec2 texels: small_shapes.shared.h, as the following but one
SHARED_CONST uint kBindShapeSetups = 56;     // uvec2[], or texels: a listed shape
SHARED_CONST uint kBindShapeKeys = 57;       // uint64_t[] rows of whole blocks; or uvec4[] of two pixels
SHARED_CONST uint kBindShapeKeyTexels = 58;  // uvec4 texels: the same, to be read
SHARED_CONST uint kBindTouchedBlocks = 59;   // uint[]   1 where shapes may be
SHARED_CONST uint kBindShapeBlocks = 60;     // uint[], or texels: those, as kBindActiveBlocks
SHARED_CONST uint kBindShapeHead = 61;       // uint[]   how many, and the dispatch over them
SHARED_CONST uint kBindBlockDepthTexels = 62;  // vec4 texels: kBindBlockDepths, to be read

/// Codes of voxels, in the grids of blockers and of blocks, from here on: a shape, and the number of its first quad.
SHARED_CONST uint kShapeCode = 0x8000u;
SHARED_CONST uint kBlockerCube = 0x7fffu;  // hides all

SHARED_CONST uint kTilePixels = 8;  // a tile of the occlusion test is 8 x 8 pixels

/// Faces whose plane is nearer than this need care, m; see faces.vert.glsl. The near plane is nearer.
SHARED_CONST float kNearestFace = 1e-3;

/// Vertices are rounded to 1/256 pixel; by one part in so many of a pixel edges move outwards, to be on the safe side.
SHARED_CONST float kVertexSteps = 256.0f / 1.25f;

SHARED_CONST uint kShadeGroup = 8;  // the shading pass works on squares of 8 x 8 pixels

/// The word of a leaf of the shadow grid: clear, and of which aligned cube of 16 or 32 voxels all is; full; or
/// kLeafMixed + place of its mask. Single words, which software gathers for all lanes at once; wider texels it fetches
/// one by one.
SHARED_CONST uint kLeafClear = 0u, kLeafInClear16 = 1u, kLeafInClear32 = 2u, kLeafFull = 3u, kLeafMixed = 4u;

/// Specialisation constants.
SHARED_CONST uint kSpecExactEdges = 0;
SHARED_CONST uint kSpecSunShadow = 1;         // by order of SunShadow
SHARED_CONST uint kSpecLight = 2;             // by order of SurfaceLight::Kind
SHARED_CONST uint kSpecInterpolation = 3;     // kLightFace, kLightVertex, kLightLinear
SHARED_CONST uint kSpecCornerOcclusion = 4;   // bool
SHARED_CONST uint kSpecToImage = 5;           // bool: shading writes targets.colour, else the radiance buffer
SHARED_CONST uint kSpecShapes = 6;            // bool: pixels may see faces of shapes
SHARED_CONST uint kSpecBlends = 7;            // bool: some chunks are drawn in part
SHARED_CONST uint kSpecCountsRays = 8;        // bool: shading counts the pixels that cast a ray to the sun
SHARED_CONST uint kSpecPutOff = 9;            // bool: that second pass
SHARED_CONST uint kSpecShadedPart = 10;       // kShaded...: what of the picture
SHARED_CONST uint kSpecSeenPutOff = 11;       // kSeenShape, kSeenMesh: what shading leaves to the second pass
SHARED_CONST uint kSpecMeshes = 12;           // bool: there are triangles, which rays to lights may meet
SHARED_CONST uint kSpecMeshPixels = 13;       // bool: pixels may see them
SHARED_CONST uint kSpecTrianglesAlone = 14;   // bool: they stand for the voxels too: rays to lights meet nothing else
SHARED_CONST uint kSpecLiquidLevels = 16;     // bool: some faces are of liquids that end within their voxels
SHARED_CONST uint kSpecSecondFaces = 17;      // bool: faces that the occlusion test has found, into what is drawn
SHARED_CONST uint kSpecListsFaces = 18;       // bool: the occlusion test lists them for that
SHARED_CONST uint kSpecShapeTile = 19;        // side of a square of pixels, px: small_shapes.shared.h
SHARED_CONST uint kSpecSkyModel = 32;         // bool: the sky of a time of day
SHARED_CONST uint kSpecLuminaires = 33;       // bool
SHARED_CONST uint kSpecMedia = 34;            // bool
SHARED_CONST uint kSpecBsdf = 35;             // bool: blocks scatter by their BSDF
SHARED_CONST uint kSpecLuminaireShadow = 36;  // kLuminaireShadow...
SHARED_CONST uint kSpecSkyRays = 37;          // rays to the sky a pixel
SHARED_CONST uint kSpecTextures = 38;         // kTexture...
SHARED_CONST uint kSpecAnisotropy = 39;       // texture_anisotropy
SHARED_CONST uint kSpecNormalDetail = 40;     // float, normal_detail
SHARED_CONST uint kSpecSunMapFilter = 41;     // int, sun_map_filter
SHARED_CONST uint kSpecSunCascades = 42;      // int, sun_map_cascades
SHARED_CONST uint kSpecSunBlockers = 43;      // bool: what isn't opaque takes its part of the sun's light
SHARED_CONST uint kSpecCloudSteps = 44;       // int, cloud_steps; 0: no clouds are seen
SHARED_CONST uint kSpecCloudLightSteps = 45;  // int, cloud_light_steps
SHARED_CONST uint kSpecCloudShadows = 46;     // bool: they dim the sun
SHARED_CONST uint kSpecFogShafts = 47;        // bool: fog asks for the sun along rays: fog_sun_rays
SHARED_CONST uint kSpecCoarseFaces = 48;     // bool: pixels may see faces of coarser levels, or stand-ins (kSeenPlaced)
SHARED_CONST uint kSpecViewEnds = 49;        // bool: the view distance ends before the world does
SHARED_CONST uint kSpecMediumKinds = 50;     // bits of MEDIUM_... and kMediumDensityGrid: those that there are
SHARED_CONST uint kSpecCloudsBefore = 51;    // bool: clouds may lie before others than the sky: SkyView
SHARED_CONST uint kSpecLuminaireKinds = 52;  // bits of LUMINAIRE_..., and kLuminaire...: those that there are

/// A record of SurfaceLightLeaf in words: 16 a direction of faces, 4 a direction of counts before slices, the first
/// code.
SHARED_CONST uint kLightLeafWords = 128u, kLightBefore = 96u, kLightFirst = 120u;
SHARED_CONST uint kLightUnknown = 0xffffffffu;
SHARED_CONST uint kLightNone = 0u, kLightLevels = 1u, kLightIrradiance = 2u;
SHARED_CONST uint kShadedAll = 0u, kShadedSurfaces = 1u, kShadedSky = 2u, kShadedPutOff = 3u;
SHARED_CONST uint kSunShadowSkyLight = 1u, kSunShadowMap = 2u, kSunShadowRay = 3u;

/// One picture. Only members of 16 bytes, so that every layout rule places them alike.
struct PictureConstants {
  vec4 corner, step_x, step_y;  // PixelRays: direction = corner + px * step_x + py * step_y
  vec4 clip_x, clip_y, clip_w;  // rows of the projection of a point relative to the camera
  vec4 fraction;                // of the camera's voxel, rounded to float; w: near plane, m
  vec4 fraction_rest;           // what rounding took off, so that a face at a hair's breadth keeps its side
  vec4 sun;                     // towards the sun; w: view distance, m
  vec4 sky_zenith, sky_horizon, sky_ground;  // radiance
  ivec4 camera_voxel;
  ivec4 region_min, region_max;       // of the shadow grid, inclusive; w of region_min: slots in its table less 1
  vec4 level_sky[4], level_block[4];  // by level: SurfaceLightDecoder
  vec4 map_u, map_v, map_w;           // of the sun's map: SunMapFrame
  ivec4 map_low, map_size;
  ivec4 light;            // x: slots of the light's table less 1
  uvec4 luminaires;       // offsets in `lighting`: records, numbers of those that light everything; z: how many; blocks
  uvec4 luminaires_seen;  // x: 1 where some are seen, y: tiles a row, z: offset of those at no place, w: how many
  uvec4 light_cells;      // offset of the table (0: none), slots less 1, log2 of a cell's voxels
  uvec4 media;            // how many, steps through a density grid, fog_sun_rays
  uvec4 light_samples;    // of each light with an area; 1: by Sobol's sequence; the picture's seed, low word and high
  vec4 sun_irradiance;    // of a plane that faces it; w: occlusion_distance, m
  vec4 eye_absorption;    // 1/m, of what the camera is in; w: 1 where it is any
  SkyModel sky;           // of kSpecSkyModel
  CloudLayer clouds;      // of kSpecCloudSteps and kSpecCloudShadows, relative to the camera's voxel
  ivec4 sun_cells;    // SunHeights: blocks along u (0: none), along v; main axis, +4 where rays go down it; k of the
                      // camera's voxel
  ivec4 sun_base;     // cell of the corner of the camera's voxel: u, v; z: metres of a ray a slab, a float's bits
  vec4 sun_u, sun_v;  // cells from there to a place, relative to the camera's voxel: dot(.xyz, place) + .w
  uvec4 meshes;       // of the triangles: nodes; where triangles, vertices and materials begin
  ivec4 mesh_base;    // the voxel that boxes are relative to; w: the largest coordinate of one, a float's bits
  uvec4 voxel_light;  // of triangles: slots of the table less 1; the code of voxels that aren't kept
  vec4 screen;        // x: width, y: height, z: metres at view depth 1 that are 1 / kVertexSteps pixel
};

/// What the temporal pass is told.
struct TemporalConstants {
  vec4 then_right;  // rows of the last picture's projection of a point relative to its camera; w: this one's shift, px
  vec4 then_down;   // w: shift
  vec4 then_forward;  // w: 1 where there is a last picture, 0 where not, -1: copy
  vec4 moved;         // m from the last picture's camera to this one's
};

SHARED uint region_hash(int x, int y, int z) {
  uint h = uint(x) * 0x9e3779b1u + uint(y) * 0x85ebca6bu + uint(z) * 0xc2b2ae35u;
  return h ^ (h >> 15);
}

/// A pixel of the target of the first pass: x = block | face << 16 | level << 19 (0: sky), y = plane of the face
/// relative to the camera's voxel, as an int.
/// With kSeenPlaced, an impostor's pixel whose ray doesn't meet that plane near the face: y = bits of the distance
/// along the ray, whose component along the camera's direction is 1.
/// Bits 24..27: of a liquid's top that lies below that plane how high in its voxel, in sixteenths; else 0.
SHARED_CONST uint kSeenFaceShift = 16u, kSeenLevelShift = 19u, kSeenPlaced = 1u << 23, kSeenLiquidShift = 24u;

SHARED uint seen_block(uint x) { return x & 0xffffu; }
SHARED uint seen_face(uint x) { return (x >> kSeenFaceShift) & 7u; }
SHARED uint seen_level(uint x) { return (x >> kSeenLevelShift) & 15u; }

/// Of a chunk, beside its corner: its level, and in 255ths how much of it is drawn and how much of the next level's
/// chunk.
SHARED_CONST uint kChunkLevel = 15u, kChunkOwnShift = 8u, kChunkNextShift = 16u;

/// Which pixels show which of two levels: a threshold in [0, 1) that looks even at any share. source Jorge Jimenez.
/// Next Generation Post Processing in Call of Duty: Advanced Warfare. 2014 (interleaved gradient noise)
#ifndef __cplusplus
float blend_threshold(vec2 pixel) { return fract(52.9829189 * fract(dot(pixel, vec2(0.06711056, 0.00583715)))); }
/// Whether a pixel shows a chunk of this detail.
bool chunk_shown(uint detail, vec2 pixel) {
  const float t = blend_threshold(pixel) * 255.0;
  return t < float(detail >> kChunkOwnShift & 255u) && t >= float(detail >> kChunkNextShift & 255u);
}
#endif

/// Where it sees the face of a shape: x = kSeenShape | quad, y = place of the chunk in the picture's list << 18 | place
/// of the voxel in the chunk, as in face_record.shared.h.
SHARED_CONST uint kSeenShape = 0x80000000u, kSeenChunkShift = 18u;
SHARED_CONST uint kMostShapeChunks = 1u << 14;

/// Where it sees a triangle that is no face: x = kSeenMesh | triangle, y = view depth, a float's bits.
SHARED_CONST uint kSeenMesh = 0x40000000u, kSeenNoFace = 0xc0000000u;

/// The buffer of triangles, in texels of four words: nodes of the tree (triangle_tree.h), two each: low corner, skip;
/// high corner, leaf. Triangles in the order of leaves: three vertices, material. Vertices, three texels each: voxel,
/// place in it (m), normal (0: the triangle's own), squares of a checkerboard. Materials, two each: the block of even
/// squares, of the others, 1 where it is a smooth surface of voxels; emitted radiance.
SHARED_CONST uint kNodeLeafBits = 3u, kNoTriangle = 0xffffffffu;

/// The table of a sky's irradiance: angles a side, see SkyLight::irradiance().
SHARED_CONST int kSkyAngles = 21;

/// A face of a shape: corner, w: lit; u, w: block as an int's bits; v, w: emission over that of a cube; normal, w:
/// direction as an int's bits, 6 for both sides; along u, w: of the corner; along v, w: of the corner: (p - corner) .
/// along = 0..1 on it; normal, w: . corner. Of the first face of a shape: its box's low corner, w: how many faces it
/// has, as an int's bits; its high corner.
SHARED_CONST uint kQuadVectors = 9u;
SHARED_CONST uint kNoQuad = 0xffffffffu;

#ifdef __cplusplus
static_assert(sizeof(PictureConstants) == (13 + 14 + 3 + 7 + 2 + 19 + 8) * 16);
}  // namespace render::raster
#endif
#endif
