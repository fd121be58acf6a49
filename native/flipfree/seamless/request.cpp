#include "flipfree/seamless/request.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "flipfree/base/error.h"
#include "flipfree/base/plane.h"
#include "flipfree/certify/certified_map.h"
#include "flipfree/mesh/adjacency.h"
#include "flipfree/mesh/validate.h"
#include "flipfree/seamless/bordered/corners.h"
#include "flipfree/seamless/signature.h"

namespace flipfree::seamless {
namespace {

// Turns with one loop the other way that are offered.
constexpr std::size_t kSingleChanges = 4;
// Share of the cost that a change must save, so that rounding does not decide; and changes, and
// sweeps over all pairs, at most, far more than were ever seen.
constexpr double kSaved = 1e-9;
constexpr int kMostChanges = 10'000;
constexpr int kMostSweeps = 100;
// Multiples in a reduced basis, at most: others come from rounding of a norm that is hardly one.
constexpr double kMostTaken = 1e6;

// Another basis of the same lattice, and what is given in it.
struct Basis {
  Eigen::MatrixXd norm;
  Eigen::VectorXd given;
  Eigen::VectorXd one_by_one;  // the nearest to each of what was given in the first basis
  Eigen::MatrixXd whole;       // its members, a row each, in whole multiples of the first ones

  // b_i - r b_k in place of b_i.
  void take_away(Eigen::Index i, Eigen::Index k, double r) {
    norm.row(i) -= r * norm.row(k);
    norm.col(i) -= r * norm.col(k);
    whole.row(i) -= r * whole.row(k);
    given[k] += r * given[i];
    one_by_one[k] += r * one_by_one[i];
  }

  // Takes away from each what makes it shorter, as long as there is such.
  void reduce() {
    bool changed = true;
    for (int sweep = 0; changed && sweep < kMostSweeps; ++sweep) {
      changed = false;
      for (Eigen::Index i = 0; i < given.size(); ++i) {
        for (Eigen::Index k = 0; k < given.size(); ++k) {
          // What lies in the middle, or is there by rounding, changes nothing.
          if (i == k || std::abs(norm(i, k)) <= (0.5 + kSaved) * norm(k, k)) continue;
          take_away(i, k, std::round(norm(i, k) / norm(k, k)));
          changed = true;
        }
      }
    }
  }

  std::vector<Index> turns(const Eigen::VectorXd& numbers) const {
    const Eigen::VectorXd in_first = whole.transpose() * numbers;
    std::vector<Index> turns;
    for (const double x : in_first) turns.push_back(static_cast<Index>(std::lround(x)));
    return turns;
  }
};

// Whole numbers near to given ones in a norm, and what changing one of them costs.
class Lattice {
 public:
  Lattice(const Eigen::VectorXd& given, const Eigen::MatrixXd& norm) : given_(given), norm_(norm) {}

  void set(const Eigen::VectorXd& numbers) {
    numbers_ = numbers;
    slope_ = 2.0 * (norm_ * (numbers_ - given_));
    cost_ = 0.5 * slope_.dot(numbers_ - given_);
  }
  const Eigen::VectorXd& numbers() const { return numbers_; }
  double cost() const { return cost_; }

  // By how much one number changes best, and the cost of that.
  int direction(Eigen::Index i) const { return slope_[i] > 0.0 ? -1 : 1; }
  double change(Eigen::Index i) const { return norm_(i, i) - std::abs(slope_[i]); }

  // Changes one number, or two, as long as that makes them nearer.
  void descend() {
    for (int i = 0; i < kMostChanges && step(); ++i) {
    }
  }

 private:
  bool step() {
    const double enough = -kSaved * cost_;
    double best = enough;
    Eigen::Index first = -1, second = -1;
    int a = 0, b = 0;
    for (Eigen::Index i = 0; i < numbers_.size(); ++i) {
      if (change(i) < best) {
        best = change(i);
        first = i;
        second = -1;
        a = direction(i);
      }
      for (Eigen::Index j = 0; j < i; ++j) {
        // Either way for the one, and what is then better for the other.
        const double product = 2.0 * norm_(i, j);
        for (const int s : {-1, 1}) {
          const double alone = norm_(i, i) + s * slope_[i] + norm_(j, j);
          const double along = slope_[j] + s * product;
          const double both = alone - std::abs(along);
          if (both < best) {
            best = both;
            first = i;
            second = j;
            a = s;
            b = along > 0.0 ? -1 : 1;
          }
        }
      }
    }
    if (first < 0) return false;
    Eigen::VectorXd changed = numbers_;
    changed[first] += a;
    if (second >= 0) changed[second] += b;
    set(changed);
    return true;
  }

  const Eigen::VectorXd& given_;
  const Eigen::MatrixXd& norm_;
  Eigen::VectorXd numbers_, slope_;
  double cost_ = 0.0;
};

bool is_norm(const Eigen::MatrixXd& matrix) {
  return matrix.allFinite() && Eigen::LLT<Eigen::MatrixXd>(matrix).info() == Eigen::Success;
}

// In the norm, or loop by loop if it is none.
Basis reduced(const std::vector<double>& angles, const Eigen::MatrixXd& norm) {
  const auto count = static_cast<Eigen::Index>(angles.size());
  Basis first;
  first.given = Eigen::Map<const Eigen::VectorXd>(angles.data(), count) / kQuarterTurn;
  first.one_by_one = first.given.array().round();
  first.whole.setIdentity(count, count);
  first.norm = norm.selfadjointView<Eigen::Lower>();
  if (is_norm(first.norm)) {
    Basis basis = first;
    basis.reduce();
    if (is_norm(basis.norm) && (basis.whole.array().abs() < kMostTaken).all()) return basis;
  }
  first.norm.setIdentity(count, count);
  return first;
}

}  // namespace

std::vector<std::vector<Index>> near_turns(
    const std::vector<double>& angles, const Eigen::MatrixXd& norm,
    const std::function<std::string(const std::vector<Index>&)>& why) {
  const Basis basis = reduced(angles, norm);
  Lattice lattice(basis.given, basis.norm);
  lattice.set(basis.one_by_one);
  lattice.descend();
  const Eigen::VectorXd nearest = lattice.numbers();
  std::vector<Eigen::Index> order;
  for (Eigen::Index i = 0; i < nearest.size(); ++i) order.push_back(i);
  std::stable_sort(order.begin(), order.end(), [&](Eigen::Index a, Eigen::Index b) {
    return lattice.change(a) < lattice.change(b);
  });
  std::vector<std::vector<Index>> found;
  const auto add = [&](const Eigen::VectorXd& numbers) {
    std::vector<Index> turns = basis.turns(numbers);
    if (!why(turns).empty()) return;
    if (std::find(found.begin(), found.end(), turns) == found.end())
      found.push_back(std::move(turns));
  };
  add(nearest);
  for (std::size_t i = 0; i < order.size() && (i < kSingleChanges || found.empty()); ++i) {
    Eigen::VectorXd numbers = nearest;
    numbers[order[i]] += lattice.direction(order[i]);
    add(numbers);
  }
  return found;
}

std::vector<std::vector<Index>> near_turns(const std::vector<Index>& cones, Index genus,
                                           const std::vector<double>& angles,
                                           const Eigen::MatrixXd& norm) {
  std::vector<Index> any;
  auto found = near_turns(angles, norm, [&](const std::vector<Index>& turns) {
    if (any.empty()) any = turns;
    return why_impossible(cones, genus, turns);
  });
  if (found.empty()) {
    const std::string why = why_impossible(cones, genus, any);
    Witness witness{"empty stratum", {{"genus", {static_cast<double>(genus)}}, {"cones", {}}}};
    for (const Index k : cone_list(cones)) witness.numbers[1].second.push_back(k);
    throw_infeasible(ErrorCode::kBadAngles, why + " Move one of the cones' angles to a third one.",
                     std::move(witness));
  }
  return found;
}

namespace {

constexpr std::size_t kMostNamed = 1000;

Index genus_of_part(const SurfacePart& part) {
  const auto faces = static_cast<Index>(part.faces.size());
  return (2 - (static_cast<Index>(part.vertices.size()) - faces / 2)) / 2;
}

// The same error with the place of the part.
[[noreturn]] void throw_of_part(const Error& error, const SurfacePart& part, bool only_one) {
  std::vector<Index> places;
  for (std::size_t i = 0; i < part.vertices.size() && places.size() < kMostNamed; ++i) {
    if (part.cones[i] != 4) places.push_back(part.vertices[i]);
  }
  ElementKind kind = ElementKind::kVertex;
  if (places.empty()) {
    kind = ElementKind::kFace;
    for (std::size_t i = 0; i < part.faces.size() && i < kMostNamed; ++i)
      places.push_back(part.faces[i]);
  }
  const std::string where = only_one ? ""
                                     : "The part of face " + face_id(part.faces.front()) + " (" +
                                           std::to_string(part.faces.size()) + " faces): ";
  throw_infeasible(error.code, where + error.message, error.witness, kind, std::move(places));
}

}  // namespace

void check_surface(const mesh::Surface& surface, ExecutionContext& context) {
  mesh::ValidateOptions rules;
  rules.allow_isolated_vertices = false;
  mesh::validate(surface, rules, context);
}

std::vector<SurfacePart> connected_parts(const mesh::Surface& surface,
                                         const mesh::Adjacency& adjacency,
                                         const std::vector<Index>& cones) {
  const mesh::CutMesh whole =
      mesh::cut_along(surface.faces, adjacency, mesh::EdgeFlags(adjacency.opposite.size(), 0));
  std::vector<SurfacePart> parts;
  for (mesh::Chart& chart : mesh::split_into_charts(surface.vertices, whole)) {
    SurfacePart& part = parts.emplace_back(SurfacePart{std::move(chart), {}});
    for (VertexId& v : part.vertices) {
      v = whole.vertex_origin[at(v)];
      part.cones.push_back(cones[at(v)]);
      if (adjacency.opposite[at(adjacency.vertex_halfedge[at(v)])] != kInvalid) continue;
      part.bordered = true;
      part.corners_given = part.corners_given || cones[at(v)] != kNotGiven;
    }
  }
  return parts;
}

void check_request(const mesh::Surface& surface, const std::vector<Index>& cones,
                   ExecutionContext& context) {
  check_surface(surface, context);
  if (cones.size() != static_cast<std::size_t>(surface.vertices.rows()))
    throw_invalid(ErrorCode::kBadShape, "cones need one number per vertex.");
  const mesh::Adjacency adjacency = mesh::build_adjacency(surface);
  for (std::size_t v = 0; v < cones.size(); ++v) {
    if (cones[v] >= kNotGiven) continue;
    throw_invalid(ErrorCode::kBadAngles,
                  "The cone at vertex " + vertex_id(v) + " has " + std::to_string(cones[v]) +
                      " quarter turns. Give every cone at least 1 (4 is flat).",
                  ElementKind::kVertex, {static_cast<Index>(v)});
  }
  const std::vector<SurfacePart> parts =
      connected_parts(surface, adjacency, flat_inside(cones, adjacency));
  for (const SurfacePart& part : parts) {
    context.check();
    if (part.bordered) continue;
    try {
      check_cones(part.cones, genus_of_part(part));
      // Loops may turn as they need to: only what no loops help is refused here.
      if (genus_of_part(part) == 1)
        near_turns(part.cones, 1, {0.0, 0.0}, Eigen::Matrix2d::Identity());
    } catch (const Infeasible& refused) {
      throw_of_part(refused.error(), part, parts.size() == 1);
    }
  }
}

namespace {

// The numbers of these ids; every one once if asked for.
std::vector<Index> numbered(const std::vector<Index>& ids, const std::vector<Index>& number,
                            bool once) {
  std::vector<Index> found;
  for (const Index i : ids) {
    if (i < 0 || static_cast<std::size_t>(i) >= number.size()) continue;
    const Index n = number[at(i)];
    if (!once || std::find(found.begin(), found.end(), n) == found.end()) found.push_back(n);
  }
  return found;
}

// `faces`, `vertices`: the caller's number of each of those that the error counts; elements beyond
// are left out, corners become faces. Each is named once, but for the ends of edges.
Error placed_in(Error error, const std::vector<FaceId>& faces,
                const std::vector<VertexId>& vertices) {
  if (error.kind == ElementKind::kCorner) {
    for (Index& c : error.elements) c /= 3;
    error.kind = ElementKind::kFace;
  }
  if (error.kind == ElementKind::kFace) {
    error.elements = numbered(error.elements, faces, true);
  } else if (error.kind == ElementKind::kVertex) {
    error.elements = numbered(error.elements, vertices, true);
  } else if (error.kind == ElementKind::kEdge) {
    const std::vector<Index> ends = numbered(error.elements, vertices, false);
    error.elements = ends.size() == error.elements.size() ? ends : std::vector<Index>{};
  }
  if (error.elements.empty()) error.kind = ElementKind::kNone;
  return error;
}

}  // namespace

void rethrow_placed(const std::vector<FaceId>& faces, const std::vector<VertexId>& vertices) {
  try {
    throw;
  } catch (const certify::CertificateFailed& failed) {
    certify::Certificate certificate = failed.certificate();
    certificate.failed_faces = numbered(certificate.failed_faces, faces, true);
    throw certify::CertificateFailed("The seamless map", std::move(certificate));
  } catch (const NotConverged& failed) {
    throw NotConverged(placed_in(failed.error(), faces, vertices));
  }
}

}  // namespace flipfree::seamless
