#include "flipfree/unwrap/seams/slits/drawn_out.h"

#include <cmath>
#include <utility>
#include <vector>

#include "flipfree/base/error.h"
#include "flipfree/base/parallel.h"
#include "flipfree/base/stats.h"
#include "flipfree/certify/measures.h"
#include "flipfree/distortion/energy/own_map.h"
#include "flipfree/distortion/minimize/boundary_barrier.h"
#include "flipfree/distortion/minimize/minimize.h"
#include "flipfree/mesh/islands.h"
#include "flipfree/mesh/topology.h"
#include "flipfree/unwrap/packing/layout.h"

namespace flipfree::unwrap {
namespace {

// Energy of a triangle that is drawn out, and the rings around such that move with it.
constexpr double kDrawnOutEnergy = 2.0;
constexpr int kMovingRings = 4;
constexpr double kDrawnOutTolerance = 1e-2;
constexpr int kMostSteps = 30;
// Of a place that is a larger share of the map, relaxing all of it is no more work.
constexpr double kMostOfMap = 0.5;

struct DrawnOutPlace {
  mesh::Surface surface;
  std::vector<VertexId> vertices;  // of the map
  std::vector<VertexId> fixed;     // its own
  Points2 uv;
};

struct Measured {
  std::vector<char> moves;  // #V
  double density = 1.0;     // UV length of a length of 1
};

Measured measure(const mesh::Surface& surface, const Points2& uv, bool keep_boundary) {
  const Points3 parts = certify::symmetric_dirichlet_parts(surface, by_corner(surface.faces, uv));
  // By areas: the best scale of the energy would follow what is drawn out.
  double area = 0.0;
  double in_map = 0.0;
  for (Eigen::Index f = 0; f < parts.rows(); ++f) {
    if (!(parts(f, 2) > 0.0) || !(parts(f, 1) > 0.0)) continue;
    area += parts(f, 2);
    in_map += parts(f, 2) * std::sqrt(parts(f, 0) / parts(f, 1));
  }
  const double unit = area / in_map;
  Measured result;
  result.moves.assign(at(static_cast<Index>(uv.rows())), 0);
  result.density = 1.0 / std::sqrt(unit);
  for (FaceId f = 0; f < surface.faces.rows(); ++f) {
    if (!(parts(f, 2) > 0.0)) continue;
    const double energy = 0.25 * (parts(f, 0) * unit + parts(f, 1) / unit);
    for (Index k = 0; k < 3 && !(energy <= kDrawnOutEnergy); ++k)
      result.moves[at(surface.faces(f, k))] = 1;
  }
  for (int ring = 0; ring < kMovingRings; ++ring) {
    const std::vector<char> before = result.moves;
    for (FaceId f = 0; f < surface.faces.rows(); ++f) {
      const auto face = surface.faces.row(f);
      if (before[at(face[0])] == 0 && before[at(face[1])] == 0 && before[at(face[2])] == 0)
        continue;
      for (Index k = 0; k < 3; ++k) result.moves[at(face[k])] = 1;
    }
  }
  if (keep_boundary) {
    for (const VertexId v :
         distortion::find_boundary(static_cast<Index>(uv.rows()), surface.faces).vertices)
      result.moves[at(v)] = 0;
  }
  return result;
}

// Faces with vertices that move, in parts that share no edge.
std::vector<DrawnOutPlace> places_of(const mesh::Surface& surface, const Points2& uv,
                                     const std::vector<char>& moves) {
  std::vector<FaceId> chosen;
  for (FaceId f = 0; f < surface.faces.rows(); ++f) {
    const auto face = surface.faces.row(f);
    if (moves[at(face[0])] != 0 || moves[at(face[1])] != 0 || moves[at(face[2])] != 0)
      chosen.push_back(f);
  }
  std::vector<Index> local(moves.size(), kInvalid);
  const mesh::Part whole = mesh::part_of(surface.faces, chosen, local);
  const mesh::Components parts = mesh::face_components(
      mesh::build_adjacency(static_cast<Index>(whole.vertices.size()), whole.faces));
  std::vector<DrawnOutPlace> places(at(parts.count));
  std::vector<std::vector<FaceId>> faces_of(places.size());
  for (std::size_t i = 0; i < chosen.size(); ++i)
    faces_of[at(parts.of_face[i])].push_back(chosen[i]);
  for (std::size_t p = 0; p < places.size(); ++p) {
    DrawnOutPlace& place = places[p];
    mesh::Part part = mesh::part_of(surface.faces, faces_of[p], local);
    place.surface.faces = std::move(part.faces);
    place.vertices = std::move(part.vertices);
    const auto size = static_cast<Eigen::Index>(place.vertices.size());
    place.surface.vertices.resize(size, 3);
    place.uv.resize(size, 2);
    for (Eigen::Index i = 0; i < size; ++i) {
      const VertexId v = place.vertices[static_cast<std::size_t>(i)];
      place.surface.vertices.row(i) = surface.vertices.row(v);
      place.uv.row(i) = uv.row(v);
      if (moves[at(v)] == 0) place.fixed.push_back(static_cast<VertexId>(i));
    }
  }
  return places;
}

void relax_place(DrawnOutPlace& place, double density, ExecutionContext& context) try {
  distortion::MinimizeOptions options;
  options.max_iterations = kMostSteps;
  options.tolerance = kDrawnOutTolerance;
  options.fixed = place.fixed;
  options.unit = density;
  options.keep_last = true;
  Stats ignored;
  place.uv = distortion::with_own_map([&] {
    return distortion::minimize_distortion(place.surface, place.uv, options, context, ignored);
  });
} catch (const NotConverged&) {
  // What cannot be improved stays.
}

}  // namespace

Points2 relaxed_where_drawn_out(const mesh::Surface& surface, Points2 uv, bool keep_boundary,
                                ExecutionContext& context) {
  const Measured measured = measure(surface, uv, keep_boundary);
  std::vector<DrawnOutPlace> places = places_of(surface, uv, measured.moves);
  const double most = kMostOfMap * static_cast<double>(surface.faces.rows());
  std::erase_if(places, [&](const DrawnOutPlace& place) {
    return place.fixed.empty() || static_cast<double>(place.surface.faces.rows()) > most;
  });
  parallel_for(context, places.size(), 1, [&](std::size_t i, std::size_t, std::size_t) {
    ExecutionContext part(&context, 1);
    relax_place(places[i], measured.density, part);
  });
  // A vertex that moves has all its faces in one place.
  for (const DrawnOutPlace& place : places) {
    for (std::size_t i = 0; i < place.vertices.size(); ++i)
      uv.row(place.vertices[i]) = place.uv.row(static_cast<Eigen::Index>(i));
  }
  return uv;
}

}  // namespace flipfree::unwrap
