/// Catmull-Clark subdivision surfaces, through OpenSubdiv. No OpenSubdiv header here.
#pragma once

#include "world/meshes/mesh.h"
#include "world/meshes/polygons.h"

namespace world {

/// The cage refined `levels` times (0..8), its vertices pushed to the limit surface. Border edges are sharp, corners of
/// the border too. Fails where the cage is no surface (edges of more than two faces), or would become more than
/// 2^23 quadrilaterals. `name` is for errors.
/// source Edwin Catmull, James Clark. Recursively generated B-spline surfaces on arbitrary topological meshes. 1978;
///        Tony DeRose, Michael Kass, Tien Truong. Subdivision Surfaces in Character Animation. 1998 (creases)
Result<TriangleMesh> subdivided(const PolygonMesh& cage, int levels, const std::string& name);

}  // namespace world
