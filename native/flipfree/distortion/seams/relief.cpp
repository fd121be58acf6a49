#include "flipfree/distortion/seams/relief.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "flipfree/base/error.h"
#include "flipfree/distortion/energy/energy.h"
#include "flipfree/distortion/energy/rest_shapes.h"
#include "flipfree/distortion/minimize/minimizer.h"
#include "flipfree/distortion/seams/seam_system.h"

namespace flipfree::distortion {
namespace {

// A triangle of more than this energy is bad. Below, steps of the whole map see true rest shapes:
// two triangles together make for the bound by which the minimiser decides (minimizer.cpp).
constexpr double kBad = 4 * kProgressiveBound;
constexpr Index kFirstReliefRings = 4;
constexpr Index kMostRings = 16;
// Share of the triangles that the rings may have together: beyond, the whole map is as quick.
constexpr double kLocalShare = 0.05;
constexpr int kMostReliefSteps = 50;
constexpr double kTolerance = 1e-2;

// Faces of `uv` beyond the bound at `scale`, marked among the vertices.
Index mark_bad(const Triangles& faces, const RestShapes& rest, double scale, const Points2& uv,
               std::vector<char>& marked) {
  // Lengths divided by `scale` are the same as a map multiplied by it.
  Index count = 0;
  for (FaceId f = 0; f < static_cast<FaceId>(faces.rows()); ++f) {
    Vector2 p[3];
    for (int k = 0; k < 3; ++k) p[k] = scale * uv.row(faces(f, k)).transpose();
    const Jacobian j = jacobian(rest.triangles[at(f)], p[0].data(), p[1].data(), p[2].data());
    if (symmetric_dirichlet(j) <= kBad) continue;
    for (int k = 0; k < 3; ++k) marked[at(faces(f, k))] = 1;
    ++count;
  }
  return count;
}

// Per vertex of the cut surface its position node, kInvalid for cones.
std::vector<Index> position_nodes(const SeamConstraints& constraints) {
  std::vector<Index> node_of(constraints.divisor.size(), kInvalid);
  for (std::size_t v = 0; v < node_of.size(); ++v) {
    for (Index t = constraints.begin[v]; t < constraints.begin[v + 1]; ++t) {
      const Index node = constraints.terms[at(t)].node;
      if (node < constraints.position_count()) node_of[v] = node;
    }
  }
  return node_of;
}

// One ring more, across seams.
void grow(const Triangles& faces, const std::vector<Index>& node_of, std::size_t node_count,
          std::vector<char>& marked) {
  std::vector<char> wider = marked;
  for (FaceId f = 0; f < static_cast<FaceId>(faces.rows()); ++f) {
    bool any = false;
    for (int k = 0; k < 3; ++k) any = any || marked[at(faces(f, k))] != 0;
    for (int k = 0; any && k < 3; ++k) wider[at(faces(f, k))] = 1;
  }
  std::vector<char> node(node_count, 0);
  for (std::size_t v = 0; v < wider.size(); ++v) {
    if (wider[v] != 0 && node_of[v] != kInvalid) node[at(node_of[v])] = 1;
  }
  for (std::size_t v = 0; v < wider.size(); ++v) {
    if (node_of[v] != kInvalid && node[at(node_of[v])] != 0) wider[v] = 1;
  }
  marked.swap(wider);
}

// The constraints among some vertices of the cut surface, all translations held, and positions that
// are not among them: what is left depends on positions alone. `number`: of each vertex among them,
// kInvalid for others.
SeamConstraints held_constraints(const SeamConstraints& whole,
                                 const std::vector<VertexId>& vertices,
                                 const std::vector<Index>& number) {
  SeamConstraints part;
  std::vector<Index> node_number(whole.position.size(), kInvalid);
  for (std::size_t n = 0; n < whole.position.size(); ++n) {
    if (number[at(whole.position[n])] == kInvalid) continue;
    node_number[n] = part.position_count();
    part.position.push_back(number[at(whole.position[n])]);
    part.direction.push_back(whole.direction[n]);
    part.real.push_back(whole.real[n]);
  }
  part.begin.push_back(0);
  for (const VertexId v : vertices) {
    for (Index t = whole.begin[at(v)]; t < whole.begin[at(v) + 1]; ++t) {
      const NodeTerm& term = whole.terms[at(t)];
      if (term.node < whole.position_count() && node_number[at(term.node)] != kInvalid)
        part.terms.push_back({node_number[at(term.node)], term.factor});
    }
    part.begin.push_back(static_cast<Index>(part.terms.size()));
    part.divisor.push_back(whole.divisor[at(v)]);
  }
  return part;
}

// The faces of which all corners are marked.
std::vector<FaceId> marked_faces(const Triangles& faces, const std::vector<char>& marked) {
  std::vector<FaceId> chosen;
  for (FaceId f = 0; f < static_cast<FaceId>(faces.rows()); ++f) {
    bool all = true;
    for (int k = 0; k < 3; ++k) all = all && marked[at(faces(f, k))] != 0;
    if (all) chosen.push_back(f);
  }
  return chosen;
}

// Optimises the chosen faces. What other faces have of their vertices is held, and a cone is.
void open_rings(const SeamConstraints& constraints, const Triangles& faces, const RestShapes& rest,
                const std::vector<Index>& node_of, double scale, const std::vector<FaceId>& chosen,
                Points2& uv, ExecutionContext& context) {
  std::vector<VertexId> vertices;
  std::vector<Index> number(node_of.size(), kInvalid);
  const auto take = [&](VertexId v) {
    if (number[at(v)] != kInvalid) return;
    number[at(v)] = static_cast<Index>(vertices.size());
    vertices.push_back(v);
  };
  Triangles part(static_cast<Eigen::Index>(chosen.size()), 3);
  RestShapes shapes;
  shapes.length = rest.length;
  for (std::size_t i = 0; i < chosen.size(); ++i) {
    shapes.triangles.push_back(rest.triangles[at(chosen[i])]);
    for (int k = 0; k < 3; ++k) {
      take(faces(chosen[i], k));
      part(static_cast<Eigen::Index>(i), k) = number[at(faces(chosen[i], k))];
    }
  }
  // A copy elsewhere holds all others.
  std::vector<char> held_node(constraints.position.size(), 0);
  std::vector<char> is_chosen(static_cast<std::size_t>(faces.rows()), 0);
  for (const FaceId f : chosen) is_chosen[at(f)] = 1;
  for (FaceId f = 0; f < static_cast<FaceId>(faces.rows()); ++f) {
    for (int k = 0; is_chosen[at(f)] == 0 && k < 3; ++k) {
      const Index node = node_of[at(faces(f, k))];
      if (node != kInvalid) held_node[at(node)] = 1;
    }
  }
  MinimizeOptions minimize;
  minimize.max_iterations = kMostReliefSteps;
  minimize.tolerance = kTolerance;
  minimize.unit = 1.0 / (rest.length * scale);
  std::vector<char> held(vertices.size(), 0);
  for (std::size_t i = 0; i < vertices.size(); ++i) {
    const Index node = node_of[at(vertices[i])];
    if (node != kInvalid && held_node[at(node)] == 0) continue;
    held[i] = 1;
    minimize.fixed.push_back(static_cast<VertexId>(i));
  }
  Points2 places(static_cast<Eigen::Index>(vertices.size()), 2);
  for (std::size_t i = 0; i < vertices.size(); ++i)
    places.row(static_cast<Eigen::Index>(i)) = uv.row(vertices[i]);
  const SeamConstraints own = held_constraints(constraints, vertices, number);
  SeamSystem system(own, part, held, context);
  places = Minimizer(part, std::move(shapes), nullptr, places, minimize, context, &system).run().uv;
  for (std::size_t i = 0; i < vertices.size(); ++i)
    uv.row(vertices[i]) = places.row(static_cast<Eigen::Index>(i));
}

}  // namespace

std::optional<Index> relieve(const SeamConstraints& constraints, const Triangles& faces,
                             const RestShapes& rest, const std::vector<char>& near, Points2& uv,
                             ExecutionContext& context) {
  const std::vector<Index> node_of = position_nodes(constraints);
  std::vector<char> marked = near;
  marked.resize(static_cast<std::size_t>(uv.rows()), 0);
  const bool asked = std::find(marked.begin(), marked.end(), char{1}) != marked.end();
  std::optional<Index> first;
  for (Index rings = kFirstReliefRings; rings <= kMostRings; rings *= 2) {
    // The scale at which the logarithms of areas average to zero: few triangles do not move it.
    const EnergySums sums = sum_energy(faces, rest.triangles, uv, context);
    const double scale = std::exp(-0.5 * sums.log_area);
    const Index bad = mark_bad(faces, rest, scale, uv, marked);
    if (bad == 0 && (first || !asked)) return first ? first : bad;
    for (Index r = 0; r < rings; ++r) grow(faces, node_of, constraints.position.size(), marked);
    const std::vector<FaceId> chosen = marked_faces(faces, marked);
    if (static_cast<double>(chosen.size()) > kLocalShare * static_cast<double>(faces.rows())) break;
    try {
      open_rings(constraints, faces, rest, node_of, scale, chosen, uv, context);
    } catch (const NotConverged& failure) {
      if (failure.error().code == ErrorCode::kTimeLimit) throw;
      break;  // the whole map may still be brought on
    }
    if (!first) first = bad;
    std::fill(marked.begin(), marked.end(), char{0});
  }
  return first;
}

}  // namespace flipfree::distortion
