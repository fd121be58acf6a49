// Straight-line drawings on the integer grid by Schnyder woods (Schnyder 1990; canonical order
// after Kant 1996).
//
//              a3
//             /|\            Peeling vertices off the outer path, one without chords at a time,
//           /  v  \          gives every inner vertex three parents: T1 towards a1, T2 towards a2
//         / /     \ \        (its neighbours on the path) and T3 towards a3 (the vertex whose
//       a1 ----------- a2    removal uncovered it).
//
// The three paths from v cut the triangle into regions; counting vertices in them gives v integer
// coordinates that sum to n - 1, and every face is positive.
//
// All steps are O(n) and in integers.
#pragma once

#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/base/types.h"

namespace flipfree::embedding {

// Barycentric integer coordinates, #V x 3, each row sums to #V - 1.
using GridPoints = Eigen::Matrix<Index, Eigen::Dynamic, 3, Eigen::RowMajor>;

// `faces`: closed triangulated sphere, simple, oriented, every vertex used. Face `outer` = (x, y,
// z) is the outer one: in the drawing of the others x, z, y run counter-clockwise around it. Throws
// InternalError if the mesh is no such sphere.
GridPoints schnyder_drawing(const Triangles& faces, Index vertex_count, FaceId outer,
                            ExecutionContext& context);

// Map of a disk onto a convex polygon with polynomial instead of exponential decay of triangle
// sizes: the disk is closed (with an apex beyond its boundary if that has more than three
// vertices), drawn on the grid, and the mean-value weights of that drawing go into Tutte's method.
// With three boundary vertices that would reproduce the drawing, which is therefore used itself.
// Isolated vertices get (0, 0). May still flip in floating point: check.
Points2 schnyder_embedding(const Triangles& faces, Index vertex_count,
                           const std::vector<VertexId>& loop, const Points2& boundary,
                           ExecutionContext& context);

}  // namespace flipfree::embedding
