// What the processor and the shaders of the transparency pass both need.
#ifndef LOAM_RENDER_RASTER_TRANSPARENCY_SHARED_H
#define LOAM_RENDER_RASTER_TRANSPARENCY_SHARED_H

#include "world/base/shared.h"

#ifdef __cplusplus
namespace render::raster {
using glsl::ivec4, glsl::uint, glsl::vec4;
#endif

SHARED_CONST uint kBindLayerFaces = 64;      // uvec2[]  records of render/extract/see_through_faces.h
SHARED_CONST uint kBindLayerChunks = 65;     // ivec4[]  corner of each chunk, relative to the camera's voxel
SHARED_CONST uint kBindLayerBlocks = 66;     // uvec4 texels: SeeThroughBlock[] by kind
SHARED_CONST uint kBindLayerConstants = 67;  // uniform LayerConstants
SHARED_CONST uint kBindLayerHeads = 68;      // uimage   lists: of a pixel kFirstNode + place of its last node, or
                                             //          kOwnNode; 0: it has none, so between pictures
SHARED_CONST uint kBindLayerNodes = 69;      // uvec4[], or texels: lists: the node before, packed interface, plane
SHARED_CONST uint kBindLayerCount = 70;      // uint     lists: nodes asked for
SHARED_CONST uint kBindLayerShown = 71;      // texture  weighted: sum of weight * (radiance, 1 - passed)
                                             //          sorted: what layers show
SHARED_CONST uint kBindLayerDepth = 72;      // texture  weighted: optical depth; a: -log of what passes all layers
                                             //          sorted: what passes them
SHARED_CONST uint kBindLayerRest = 73;       // texture  weighted: absorption that is entered and not left
SHARED_CONST uint kBindBlockRegions = 74;    // ivec4 texels  grid of blocks: hash table, as kBindRegions
SHARED_CONST uint kBindBlockLeaves = 75;     // uint texels  4096 a region: kBlockUniform | block, or place of its ids
SHARED_CONST uint kBindBlockIds = 76;        // uint texels  256 a mixed leaf: two ids a word
SHARED_CONST uint kBindBlockKinds = 77;  // uvec2 texels  by code: kind, or kKindSolid; 1 for a mirror, kKind...Shift
SHARED_CONST uint kBindBehind = 78;      // image    the picture without layers: what bent rays sample
SHARED_CONST uint kBindMirrored = 79;    // float[]  planar: the picture from behind the mirror

SHARED_CONST uint kBindLayerSorted = 80;  // uvec4[]  sorted: the two words of a record, and its chunk

SHARED_CONST uint kBindLayerTiles = 81;      // uint[], or texels: lists: listed_tile() of those that have a layer
SHARED_CONST uint kBindLayerDispatch = 82;   // uint[]   lists: the dispatches over them: ListHead, slices
SHARED_CONST uint kBindLayerTileMarks = 83;  // uint[]   lists: 1 where a tile has a layer; 0 between pictures
SHARED_CONST uint kBindLayerOwnNodes = 84;   // texture  lists: a pixel's own node: packed interface, plane
SHARED_CONST uint kBindLayerMasks = 85;      // uvec4[], or uint texels: layer_blocks.h: of a pixel a bit for each layer
                                             //          that its block lists, 1 where it sees that

SHARED_CONST int kLayerBlockTexels = 5;  // of a SeeThroughBlock

SHARED_CONST uint kBlockUniform = 0x80000000u;
SHARED_CONST uint kKindSolid = 0xffffu;  // what no ray sees through; air has the kind 0
/// Codes up to the palette's size are blocks' ids; those beyond stand for liquids that end within their voxels. Of each
/// its level in sixteenths, or 0, and its block. With kSpecShapeCodes those from kShapeCode on are shapes.
SHARED_CONST uint kKindLevelShift = 1u, kKindBlockShift = 16u;

SHARED_CONST uint kSpecCoveragePattern = 64;  // by order of CoveragePattern
SHARED_CONST uint kSpecRefraction = 65;       // by order of Refraction
SHARED_CONST uint kSpecReflection = 66;       // by order of Reflection
SHARED_CONST uint kSpecSortedRecords = 67;    // bool: faces are read from kBindLayerSorted
SHARED_CONST uint kSpecAddsShown = 68;        // bool: the second of two passes
SHARED_CONST uint kSpecClips = 69;        // bool: a picture in a mirror; light.yzw of the picture: axis, plane, side
SHARED_CONST uint kSpecLayerMatte = 70;   // bool: the world holds sheets or partial coverage, which are lit
SHARED_CONST uint kSpecBodies = 71;       // bool: the depth image says more than kBindSeen, there may be bodies
SHARED_CONST uint kSpecListedTiles = 72;  // bool: lists: of the tiles that have a layer, else of all
SHARED_CONST uint kSpecEyeInAir = 73;     // bool: the eye is known to be in air
SHARED_CONST uint kSpecShapeCodes = 74;   // bool: the grid of blocks says where shapes stand: kShapeCode
SHARED_CONST uint kSpecLayerEmits = 76;   // bool: the world holds see-through blocks that emit
SHARED_CONST uint kSpecLayerBlocks = 75;  // bool: layers are listed by block of pixels, not by pixel: layer_blocks.h
SHARED_CONST uint kRefractionNone = 0u, kRefractionScreen = 1u, kRefractionTraced = 2u;
SHARED_CONST uint kReflectionNone = 0u, kReflectionScreen = 1u, kReflectionPlanar = 2u, kReflectionTraced = 3u;

SHARED_CONST uint kOwnNode = 1u, kFirstNode = 2u;

/// Only members of 16 bytes, so that every layout rule places them alike.
struct LayerConstants {
  ivec4 eye;  // x: kind of the block that the eye is in; y: nodes that fit; z: slots of the blocks' table less 1;
              // w: pixels a row
  ivec4 region_min;  // of the grid of blocks, inclusive
  ivec4 region_max;
  ivec4 mirror;  // planar: x: axis of the plane, or -1; y: the plane relative to the camera's voxel
  vec4 mirror_x, mirror_y, mirror_w;  // rows of the mirrored camera's projection, of a direction in the world
};

/// An interface in a word: kind of the owner, direction of its face << 13, kind of what lies beyond << 16, and of a
/// liquid's top that lies lower than the plane how high in its voxel, in sixteenths, << 28; else 0.
SHARED uint packed_interface(uint owner, uint face, uint beyond, uint level) {
  return owner | face << 13u | beyond << 16u | level << 28u;
}
SHARED uint interface_level(uint packed) { return packed >> 28u; }
SHARED uint interface_axis(uint packed) { return packed >> 14u & 3u; }

/// Layers of a block a word of its pixels' masks has. Of masks: block by block, word by word, row by row of pixels.
SHARED_CONST uint kMaskLayers = 32u;
/// In the count of a block's layers, once some pixel has found one that it sees.
SHARED_CONST uint kBlockIsSeen = 0x80000000u;

/// A tile of 8 x 8 pixels, and how many words its masks have.
SHARED_CONST uint kTileBits = 12u, kMostWords = 255u;
SHARED uint listed_tile(uint x, uint y, uint words) { return x | y << kTileBits | words << 2u * kTileBits; }

/// Place of a tile of 8 x 8 pixels in kBindLayerTileMarks.
SHARED int tile_place(int x, int y, int pixels_a_row) { return y * ((pixels_a_row + 7) >> 3) + x; }

#ifdef __cplusplus
}  // namespace render::raster
#endif
#endif
