#include "flipfree/field/smoothest.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <optional>
#include <utility>

#include "flipfree/base/error.h"
#include "flipfree/base/lists.h"
#include "flipfree/field/graph_system.h"
#include "flipfree/mesh/adjacency.h"
#include "flipfree/mesh/face_area.h"
#include "flipfree/numeric/dense_factors.h"

namespace flipfree::field {

namespace {

// A cross in face f is the complex number u = exp(4 i angle(f)): its four directions have one.
// Across an edge it is carried by a unit number, t = exp(4 i (direction(h) - direction(o))), and
// smooth is what makes E of graph_system.h small, with edge_weights().

// Crosses, and what ties them together: those of connected faces, or coarser ones.
struct CrossGraph {
  using Edge = GraphEdge<std::complex<double>>;
  std::vector<Edge> edges;   // sorted by f, then g
  std::vector<double> area;  // of each node; sum about 1
  std::vector<double> bent;  // of |u|^2, per node: what no u can have less
};
using FieldSystem = GraphSystem<std::complex<double>>;
// A component of the surface: its nodes are these faces, ascending.
struct FaceGraph : CrossGraph {
  std::vector<FaceId> faces;
};

// One graph for each component of the surface. Cost: O(#F).
std::vector<FaceGraph> face_graphs(const Frames& frames) {
  const mesh::Surface& surface = frames.surface;
  const mesh::Adjacency& adjacency = surface.adjacency();
  const mesh::Components components = mesh::face_components(adjacency);
  std::vector<FaceGraph> graphs(at(components.count));
  const auto count = static_cast<FaceId>(surface.faces.rows());
  std::vector<Index> place(at(count));
  const std::vector<double> area = face_areas(surface);
  const std::vector<double> weight = edge_weights(surface, area);
  for (FaceId f = 0; f < count; ++f) {
    FaceGraph& graph = graphs[at(components.of_face[at(f)])];
    place[at(f)] = static_cast<Index>(graph.faces.size());
    graph.faces.push_back(f);
    graph.area.push_back(area[at(f)]);
  }
  for (FaceId f = 0; f < count; ++f) {
    FaceGraph& graph = graphs[at(components.of_face[at(f)])];
    for (HalfedgeId h = 3 * f; h < 3 * f + 3; ++h) {
      const HalfedgeId o = adjacency.opposite[at(h)];
      if (o == kInvalid || o / 3 < f) continue;
      graph.edges.push_back(
          {place[at(f)], place[at(o / 3)], weight[at(h)],
           std::polar(1.0, 4.0 * (frames.direction[at(h)] - frames.direction[at(o)]))});
    }
  }
  for (FaceGraph& graph : graphs) {
    double sum = 0.0;
    for (const double a : graph.area) sum += a;
    // A face without area would resist nothing.
    const double mean = 1.0 / static_cast<double>(graph.area.size());
    for (double& a : graph.area) a = sum > 0.0 ? std::max(a / sum, 1e-6 * mean) : mean;
    graph.bent.assign(graph.area.size(), 0.0);
    std::stable_sort(graph.edges.begin(), graph.edges.end());
  }
  return graphs;
}

// A graph of crosses with about half as many nodes: neighbours that are tied closest are taken for
// one, whose crosses are parallel. What is topological about a smooth field is decided far above
// the size of a triangle; all faces have their say when the directions are relaxed
// (prescribed.h).

struct Coarsened {
  CrossGraph graph;
  // Per node of the finer graph: its node here, and u there = carry * u here.
  std::vector<Index> node;
  std::vector<std::complex<double>> carry;
};

// Pairs, each node with the neighbour of the heaviest edge that is still single.
void pair_nodes(const CrossGraph& graph, const std::vector<char>& alone, Coarsened& out) {
  const Lists<const CrossGraph::Edge*> edges_at(graph.area.size(), [&](const auto& add) {
    for (const CrossGraph::Edge& e : graph.edges) {
      add(e.f, &e);
      add(e.g, &e);
    }
  });
  const auto count = static_cast<Index>(graph.area.size());
  out.node.assign(at(count), kInvalid);
  out.carry.assign(at(count), 1.0);
  for (Index f = 0; f < count; ++f) {
    if (out.node[at(f)] != kInvalid) continue;
    const auto own = static_cast<Index>(out.graph.area.size());
    out.node[at(f)] = own;
    out.graph.area.push_back(graph.area[at(f)]);
    out.graph.bent.push_back(graph.bent[at(f)]);
    if (alone[at(f)] != 0) continue;
    const CrossGraph::Edge* best = nullptr;
    for (const CrossGraph::Edge* e : edges_at[f]) {
      const Index g = e->f == f ? e->g : e->f;
      if (g == f || out.node[at(g)] != kInvalid || alone[at(g)] != 0) continue;
      if (best == nullptr || e->weight > best->weight) best = e;
    }
    if (best == nullptr) continue;
    const Index g = best->f == f ? best->g : best->f;
    out.node[at(g)] = own;
    out.carry[at(g)] = best->f == f ? std::conj(best->carry) : best->carry;
    out.graph.area.back() += graph.area[at(g)];
    out.graph.bent.back() += graph.bent[at(g)];
  }
}

// `alone`: flags of nodes that are not joined with others. E of a u that is constant on each pair
// is that of the coarser graph. Cost: O(nodes log nodes).
Coarsened coarsen(const CrossGraph& graph, const std::vector<char>& alone) {
  Coarsened out;
  pair_nodes(graph, alone, out);
  std::vector<CrossGraph::Edge> edges;
  for (const CrossGraph::Edge& e : graph.edges) {
    const Index f = out.node[at(e.f)], g = out.node[at(e.g)];
    const std::complex<double> carry = std::conj(out.carry[at(e.f)]) * e.carry * out.carry[at(e.g)];
    if (f == g) {
      out.graph.bent[at(f)] += e.weight * std::norm(1.0 - carry);
    } else if (f < g) {
      edges.push_back({f, g, e.weight, carry});
    } else {
      edges.push_back({g, f, e.weight, std::conj(carry)});
    }
  }
  std::stable_sort(edges.begin(), edges.end());
  // Edges between the same two nodes become one: sum w |u_f - t u_g|^2 = |sum w t| |u_f - .. u_g|^2
  // and what is left over of the weights, on both.
  for (std::size_t i = 0; i < edges.size();) {
    std::complex<double> sum = 0.0;
    double weight = 0.0;
    std::size_t k = i;
    for (; k < edges.size() && edges[k].f == edges[i].f && edges[k].g == edges[i].g; ++k) {
      sum += edges[k].weight * edges[k].carry;
      weight += edges[k].weight;
    }
    const double left = std::abs(sum);
    out.graph.bent[at(edges[i].f)] += weight - left;
    out.graph.bent[at(edges[i].g)] += weight - left;
    if (left > 0.0) out.graph.edges.push_back({edges[i].f, edges[i].g, left, sum / left});
    i = k;
  }
  return out;
}

// The flow's step: share of the component's area that it smooths over. Its inverse is added to E
// per area, for the eigenvector too: then one factorization does for both. Eigenvalues are some
// tens.
constexpr double kFlowArea = 0.01;
constexpr int kMostFlowSteps = 16;
// Larger graphs are coarsened first: faces in clusters are as good, relaxed afterwards.
constexpr std::size_t kEnoughNodes = 20'000;
// Mean change of a cross at which the flow ends.
constexpr double kSettled = 2e-3;
constexpr int kMostLanczosSteps = 24;
constexpr int kStepsBetweenChecks = 3;
// Of the eigenvalue: the vector is where the flow begins.
constexpr double kResidual = 1e-2;

Eigen::Map<const Eigen::VectorXd> areas_of(const CrossGraph& graph) {
  return {graph.area.data(), static_cast<Eigen::Index>(graph.area.size())};
}

// Of the least eigenvalues, with the factor of E + area / kFlowArea: the first eigenvector, and
// what is known of the second, both of unit length in the mean.
struct Eigenvectors {
  Crosses first, second;
};
Eigenvectors least_eigenvectors(const CrossGraph& graph, const FieldSystem& system,
                                ExecutionContext& context) {
  const auto count = static_cast<Eigen::Index>(graph.area.size());
  const Eigen::VectorXd root = areas_of(graph).cwiseMax(1e-300).cwiseSqrt();
  // Lanczos: root B^-1 root, whose largest eigenvalue is wanted.
  const auto most = std::min<Eigen::Index>(kMostLanczosSteps, count);
  Eigen::MatrixXcd basis(count, most);
  Eigen::MatrixXd projected = Eigen::MatrixXd::Zero(most, most);
  basis.col(0) = root.cast<std::complex<double>>() / root.norm();
  const Crosses none = Crosses::Zero(count);
  for (Eigen::Index k = 0; k < most; ++k) {
    context.report("cross field", 0.5 + 0.25 * static_cast<double>(k) / static_cast<double>(most));
    Crosses next = system.solve(root.cwiseProduct(basis.col(k)), none, context).cwiseProduct(root);
    projected(k, k) = basis.col(k).dot(next).real();
    const Eigen::VectorXcd share = basis.leftCols(k + 1).adjoint() * next;
    next -= basis.leftCols(k + 1) * share;
    const double beta = next.norm();
    const bool last = k + 1 == most || beta <= 1e-12 * projected(0, 0);
    if (last || (k + 1) % kStepsBetweenChecks == 0) {
      const auto small =
          numeric::symmetric_eigen(Eigen::MatrixXd(projected.topLeftCorner(k + 1, k + 1)));
      const auto vector = [&](Eigen::Index i) -> Crosses {
        const Eigen::VectorXd share = small.vectors.col(i);
        return (basis.leftCols(k + 1) * share.cast<std::complex<double>>()).cwiseQuotient(root);
      };
      const double left = beta * std::abs(small.vectors(k, k));
      if (last || left <= kResidual * small.values[k])
        return {vector(k), vector(std::max<Eigen::Index>(k - 1, 0))};
    }
    projected(k, k + 1) = projected(k + 1, k) = beta;
    basis.col(k + 1) = next / beta;
  }
  throw InternalError("Lanczos' iteration ends with its last step");
}

void to_unit_length(Crosses& u) {
  for (Eigen::Index f = 0; f < u.size(); ++f) {
    const double length = std::abs(u[f]);
    if (length > 1e-290) u[f] /= length;
  }
}

// What the nodes of one graph are asked for.
struct Asked {
  Crosses pull;                // weight * area * wish
  std::vector<double> weight;  // times area
  std::vector<char> held;
  Crosses given;  // of held nodes
  bool any = false;
};

double energy(const CrossGraph& graph, const Crosses& u) {
  double sum = 0.0;
  for (const CrossGraph::Edge& e : graph.edges)
    sum += e.weight * std::norm(u[e.f] - e.carry * u[e.g]);
  return sum;
}

// The flow from crosses of unit length to where it changes them no more.
Crosses settled(const CrossGraph& graph, const Asked& asked, const FieldSystem& system, Crosses u,
                ExecutionContext& context) {
  const Eigen::VectorXd inertia = areas_of(graph) / kFlowArea;
  for (int step = 0; step < kMostFlowSteps; ++step) {
    context.report("cross field", 0.75 + 0.25 * step / kMostFlowSteps);
    Crosses next = system.solve(asked.pull + inertia.cwiseProduct(u), asked.given, context);
    to_unit_length(next);
    const double change = (next - u).cwiseAbs().dot(areas_of(graph));
    u = std::move(next);
    if (change < kSettled) break;
  }
  return u;
}

Crosses flow(const CrossGraph& graph, const Asked& asked, ExecutionContext& context) {
  std::vector<double> diagonal;
  for (std::size_t i = 0; i < graph.area.size(); ++i)
    diagonal.push_back(graph.bent[i] + (asked.weight[i] + graph.area[i] / kFlowArea));
  for (const CrossGraph::Edge& e : graph.edges) {
    diagonal[at(e.f)] += e.weight;
    diagonal[at(e.g)] += e.weight;
  }
  std::optional<ProgressRange> range(std::in_place, context, 0.0, 0.5);
  const FieldSystem system(graph.edges, diagonal, asked.held, context);
  range.reset();
  const auto run = [&](Crosses u) {
    to_unit_length(u);
    return settled(graph, asked, system, std::move(u), context);
  };
  if (asked.any) return run(system.solve(asked.pull, asked.given, context));
  // The first eigenvector may be one of many, and one with cones that nobody wants: on a sphere of
  // meridians and parallels it has two without any angle. Mixed with the second it is another.
  const Eigenvectors start = least_eigenvectors(graph, system, context);
  Crosses one = run(start.first), other = run(start.first + start.second);
  return energy(graph, other) < energy(graph, one) ? other : one;
}

Asked restricted(const Asked& fine, const Coarsened& to) {
  const auto count = static_cast<Eigen::Index>(to.graph.area.size());
  Asked asked{Crosses::Zero(count), std::vector<double>(at(count), 0.0),
              std::vector<char>(at(count), 0), Crosses::Zero(count), fine.any};
  for (std::size_t i = 0; i < to.node.size(); ++i) {
    const Index node = to.node[i];
    const auto f = static_cast<Eigen::Index>(i);
    asked.pull[node] += std::conj(to.carry[i]) * fine.pull[f];
    asked.weight[at(node)] += fine.weight[i];
    if (fine.held[i] == 0) continue;
    asked.held[at(node)] = 1;
    asked.given[node] = fine.given[f];
  }
  return asked;
}

Crosses flow_coarsely(const CrossGraph& graph, const Asked& asked, ExecutionContext& context) {
  if (graph.area.size() <= kEnoughNodes) return flow(graph, asked, context);
  const Coarsened to = coarsen(graph, asked.held);
  // Where next to nothing was joined, because it is held, nothing is gained.
  if (to.graph.area.size() > graph.area.size() / 10 * 9) return flow(graph, asked, context);
  const Crosses coarse = flow_coarsely(to.graph, restricted(asked, to), context);
  Crosses u(static_cast<Eigen::Index>(to.node.size()));
  for (std::size_t i = 0; i < to.node.size(); ++i)
    u[static_cast<Eigen::Index>(i)] = to.carry[i] * coarse[to.node[i]];
  return u;
}

}  // namespace

Crosses smoothest(const Frames& frames, const Wishes& wishes, std::vector<double>& pull,
                  ExecutionContext& context) {
  Crosses all(wishes.cross.size());
  pull.resize(wishes.weight.size());
  double done = 0.0;
  for (const FaceGraph& graph : face_graphs(frames)) {
    const auto count = static_cast<Eigen::Index>(graph.faces.size());
    const double share = static_cast<double>(count) / static_cast<double>(all.size());
    const ProgressRange range(context, done, std::min(1.0, done + share));
    done += share;
    Asked asked{Crosses(count), std::vector<double>(at(count)), std::vector<char>(at(count)),
                Crosses::Zero(count)};
    for (Eigen::Index i = 0; i < count; ++i) {
      const FaceId f = graph.faces[at(i)];
      asked.weight[at(i)] = pull[at(f)] = wishes.weight[at(f)] * graph.area[at(i)];
      asked.held[at(i)] = wishes.held[at(f)];
      asked.pull[i] = asked.weight[at(i)] * wishes.cross[f];
      if (asked.held[at(i)] != 0) asked.given[i] = wishes.cross[f];
      asked.any = asked.any || asked.weight[at(i)] > 0.0 || asked.held[at(i)] != 0;
    }
    const Crosses u = flow_coarsely(graph, asked, context);
    for (Eigen::Index i = 0; i < count; ++i) all[graph.faces[at(i)]] = u[i];
  }
  return all;
}

namespace {

using Matrix3 = Eigen::Matrix3d;

// Weight per share of area of an alignment of 0.5: smoothness over a length l weighs 1 / l^2, in
// units in which the surface has the area 1.
constexpr double kHalf = 100.0;
// Times the square root of the area: curvatures well below it are noise.
constexpr double kFaint = 0.5;
// Curvatures whose difference, squared, is a smaller share of their squares are equal up to
// rounding.
constexpr double kEqual = 1e-20;

double weight_of(double alignment) { return kHalf * alignment / (1.0 - alignment); }

// Per vertex, the bending along the edges around it: length * dihedral angle * direction twice
// (Cohen-Steiner, Morvan 2003), half of each edge's; and a third of the areas around it.
struct Bending {
  std::vector<Matrix3> tensor;
  std::vector<double> area;
  double total = 0.0;
};

Bending measure_bending(const mesh::Surface& surface) {
  const mesh::Adjacency& adjacency = surface.adjacency();
  const auto vertices = at(surface.vertices.rows());
  Bending bending{std::vector<Matrix3>(vertices, Matrix3::Zero()),
                  std::vector<double>(vertices, 0.0), 0.0};
  const auto faces = static_cast<FaceId>(surface.faces.rows());
  Points3 normal(faces, 3);
  for (FaceId f = 0; f < faces; ++f) {
    const auto [a, b] = mesh::sides_at(surface, 3 * f);
    const Vector3 n = a.cross(b);
    const double area = 0.5 * n.norm();
    normal.row(f) = n.normalized();
    bending.total += area;
    for (int k = 0; k < 3; ++k) bending.area[at(surface.faces(f, k))] += area / 3.0;
  }
  for (HalfedgeId h = 0; h < 3 * faces; ++h) {
    const HalfedgeId o = adjacency.opposite[at(h)];
    if (o == kInvalid || o < h) continue;
    const VertexId a = mesh::source(surface.faces, h), b = mesh::target(surface.faces, h);
    const Vector3 e = surface.vertices.row(b) - surface.vertices.row(a);
    const Vector3 direction = e.normalized();
    const Vector3 n = normal.row(h / 3), m = normal.row(o / 3);
    const double angle = std::atan2(n.cross(m).dot(direction), n.dot(m));
    const Matrix3 part = (0.5 * angle * e.norm()) * direction * direction.transpose();
    bending.tensor[at(a)] += part;
    bending.tensor[at(b)] += part;
  }
  return bending;
}

}  // namespace

void follow_curvature(const mesh::Surface& surface, double alignment, Wishes& wishes) {
  if (alignment <= 0.0) return;
  const Bending bending = measure_bending(surface);
  const double faint = kFaint * kFaint / bending.total;
  for (FaceId f = 0; f < static_cast<FaceId>(surface.faces.rows()); ++f) {
    Matrix3 tensor = Matrix3::Zero();
    double area = 0.0;
    for (int k = 0; k < 3; ++k) {
      tensor += bending.tensor[at(surface.faces(f, k))];
      area += bending.area[at(surface.faces(f, k))];
    }
    tensor /= std::max(area, 1e-300);
    // In the plane of the face, axes along its first edge and to the left of it.
    const auto [first, side] = mesh::sides_at(surface, 3 * f);
    const Vector3 x = first.normalized(), y = x.cross(side).cross(x).normalized();
    const double xx = x.dot(tensor * x), yy = y.dot(tensor * y), xy = x.dot(tensor * y);
    // Twice the angle, with the difference of the two curvatures; squared, four times.
    const std::complex<double> difference(xx - yy, 2.0 * xy);
    const double squares = xx * xx + yy * yy + 2.0 * xy * xy;
    const double unequal = std::norm(difference);
    if (!(unequal > kEqual * squares) || wishes.held[at(f)] != 0) continue;
    wishes.cross[f] = difference * difference / unequal;
    wishes.weight[at(f)] = weight_of(alignment) * unequal / (squares + faint);
  }
}

void follow_edges(const Frames& frames, const mesh::EdgeFlags& edges, bool boundary, double weight,
                  Wishes& wishes) {
  const mesh::Surface& surface = frames.surface;
  const std::vector<HalfedgeId>& opposite = surface.adjacency().opposite;
  for (FaceId f = 0; f < static_cast<FaceId>(surface.faces.rows()); ++f) {
    std::complex<double> sum = 0.0, longest = 0.0;
    double most = 0.0;
    for (HalfedgeId h = 3 * f; h < 3 * f + 3; ++h) {
      if (edges[at(h)] == 0 && !(boundary && opposite[at(h)] == kInvalid)) continue;
      const double length = (surface.vertices.row(mesh::target(surface.faces, h)) -
                             surface.vertices.row(mesh::source(surface.faces, h)))
                                .norm();
      const auto along = std::polar(1.0, 4.0 * frames.direction[at(h)]);
      sum += length * along;
      if (length > most) {
        most = length;
        longest = along;
      }
    }
    if (!(most > 0.0)) continue;
    wishes.cross[f] = std::abs(sum) > 1e-3 * most ? sum / std::abs(sum) : longest;
    if (weight >= 1.0) {
      wishes.held[at(f)] = 1;
    } else {
      wishes.weight[at(f)] = weight_of(weight);
    }
  }
}

std::vector<double> curvature_sizing(const mesh::Surface& surface, double share) {
  constexpr double kMostBent = 16.0;
  constexpr double kExtent = 0.05;  // of the square root of the area
  constexpr double kMostRings = 200.0;
  const Bending bending = measure_bending(surface);
  std::vector<double> bent, area = bending.area;
  double mean = 0.0;
  for (const Matrix3& tensor : bending.tensor) {
    bent.push_back(tensor.norm());
    mean += bent.back() / bending.total;
  }
  // A round of means over neighbours spreads by about an edge's square.
  const double rounds =
      std::min(kMostRings, kExtent * kExtent * static_cast<double>(surface.faces.rows()));
  for (int round = 0; round < rounds; ++round) {
    for (std::vector<double>* values : {&bent, &area}) {
      std::vector<double> sum = *values;
      std::vector<double> count(sum.size(), 1.0);
      for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(surface.faces.size()); ++h) {
        const VertexId a = mesh::source(surface.faces, h), b = mesh::target(surface.faces, h);
        sum[at(a)] += (*values)[at(b)];
        count[at(a)] += 1.0;
      }
      for (std::size_t v = 0; v < sum.size(); ++v) (*values)[v] = sum[v] / count[v];
    }
  }
  std::vector<double> sizing;
  for (std::size_t v = 0; v < bent.size(); ++v) {
    const double ratio = area[v] > 0.0 && mean > 0.0 ? bent[v] / area[v] / mean : 1.0;
    sizing.push_back(std::pow(std::clamp(ratio, 1.0 / kMostBent, kMostBent), 0.5 * share));
  }
  return sizing;
}

void check_sizing(const std::vector<double>& sizing, const mesh::Surface& surface) {
  if (sizing.empty()) return;
  if (sizing.size() != at(surface.vertices.rows()))
    throw_invalid(ErrorCode::kBadShape, "sizing needs one number per vertex.");
  for (std::size_t v = 0; v < sizing.size(); ++v) {
    if (sizing[v] > 0.0 && std::isfinite(sizing[v])) continue;
    throw_invalid(ErrorCode::kBadOption,
                  "sizing at vertex " + vertex_id(v) +
                      " is not a positive number. Give the length in the map of a length 1 there.",
                  ElementKind::kVertex, {static_cast<Index>(v)});
  }
}

Frames sized_frames(const Frames& frames, const std::vector<double>& sizing) {
  // By so much a direction changes at most: more is a jump of sizes that no triangle there can
  // take.
  constexpr double kMost = 0.125 * std::numbers::pi;
  const mesh::Surface& surface = frames.surface;
  const std::vector<HalfedgeId>& opposite = surface.adjacency().opposite;
  Frames sized = frames;
  for (HalfedgeId h = 0; at(h) < sized.direction.size(); ++h) {
    if (opposite[at(h)] == kInvalid) continue;
    const double growth = std::log(sizing[at(mesh::target(surface.faces, h))] /
                                   sizing[at(mesh::source(surface.faces, h))]);
    if (growth == 0.0) continue;  // also where a corner has no angle
    // d(angle at j) = cot(angle at k) / 2 (p_i - p_j) + cot(angle at i) / 2 (p_k - p_j) to first
    // order, as both edges of the corner at j change (Springborn, Schroeder, Pinkall 2008).
    const double change = -0.5 * growth / std::tan(frames.corner[at(previous_corner(h))]);
    sized.direction[at(h)] += std::clamp(change, -kMost, kMost);
  }
  return sized;
}

}  // namespace flipfree::field
