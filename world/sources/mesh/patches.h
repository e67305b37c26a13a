/// Bicubic patches: surfaces from a net of control points, and their triangles.
#pragma once

#include <array>
#include <vector>

#include "world/meshes/mesh.h"

namespace world {

/// 16 Bezier control points, [row][column]; v runs along rows, u along columns; the normal is du x dv.
using BezierPatch = std::array<Vec3d, 16>;

/// Values at (u, v) in [0, 1]^2.
Vec3d patch_point(const BezierPatch& patch, double u, double v);

/// The Bezier patches of a uniform cubic B-spline over a net of rows x columns control points (each at least 4). A
/// closed direction wraps: its last patches use its first points again.
std::vector<BezierPatch> patches_from_bspline(const std::vector<Vec3d>& net, int rows, int columns, bool closed_rows,
                                              bool closed_columns);

/// How many parts each patch must be divided into, along each side, so that its triangles lie within `error` of it.
/// bound  1/8 (h_u^2 |S_uu| + 2 h_u h_v |S_uv| + h_v^2 |S_vv|); the second derivatives of a Bezier patch lie in the
///        hull of differences of its control points
/// source Daniel Filip, Robert Magedson, Robert Markot. Surface Algorithms Using Bounds on Derivatives. 1986
int divisions_for(const BezierPatch& patch, double error);

/// All patches, each as 2 n^2 triangles. Corners that patches share are computed from equal numbers, so they fall
/// together where the patches' control points do.
TriangleMesh triangles_of(const std::vector<BezierPatch>& patches, int divisions);

}  // namespace world
