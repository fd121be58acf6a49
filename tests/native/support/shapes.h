// Meshes that tests generate, each small enough to reason about or scalable by an argument.
#pragma once

#include <array>
#include <vector>

#include "flipfree/mesh/surface.h"

namespace flipfree::test {

// Triangulated (columns x rows) unit grid in the plane z = 0: (columns + 1)(rows + 1) vertices, a
// disk.
mesh::Surface grid(Index columns, Index rows);
// The same over [0, 1]^2 with z = height * sin(frequency * pi * x) * sin(frequency * pi * y).
mesh::Surface bumpy_grid(Index columns, Index rows, double height, double frequency);
// Sphere of radius 1 with two poles, `rings` - 1 rings of `sectors` vertices between them; closed,
// genus 0.
mesh::Surface sphere(Index sectors, Index rings);
// Torus with radii 1 and `minor`; closed, genus 1.
mesh::Surface torus(Index sectors, Index rings, double minor = 0.4);
// Open cylinder of radius 1, unit height; two boundary loops.
mesh::Surface cylinder(Index sectors, Index rings);
using Cell = std::array<Index, 3>;
// Cubes of a flat plate, (2 holes + 1) x 3 x 1, with so many square holes through it.
std::vector<Cell> plate(Index holes);
// The surface of unit cubes, no two of which touch in an edge or a corner only; closed. Every
// square is n x n cells of two triangles each, (0, 0) (1, 0) (1, 1) and (0, 0) (1, 1) (0, 1).
mesh::Surface of_cubes(const std::vector<Cell>& cells, Index n);
// Regular tetrahedron, closed.
mesh::Surface tetrahedron();

// Tube of radius 1 and unit ring distance, closed at the far end by a fan, open at ring 0: a disk
// with `sectors` boundary vertices whose Tutte map decays exponentially with `rings`.
mesh::Surface tube(Index sectors, Index rings);
// Stacked (Apollonian) triangulation: starting from one triangle, a vertex is put into a face and
// joined to its corners, `vertices` - 3 times. kRandom: any face; kDeep: always the newest one;
// kMixed: one of the three newest. A disk with three boundary vertices; new vertices lie at the
// centroids of their faces.
enum class Stacking { kRandom, kDeep, kMixed };
mesh::Surface stacked(Index vertices, Stacking stacking, unsigned seed = 1);

// Both in one surface, the second moved aside by 20 along each axis.
mesh::Surface beside(const mesh::Surface& first, const mesh::Surface& second);
}  // namespace flipfree::test
