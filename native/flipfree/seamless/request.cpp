#include "flipfree/seamless/request.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>
#include <string>
#include <utility>

#include "flipfree/base/error.h"
#include "flipfree/base/failure.h"
#include "flipfree/base/plane.h"
#include "flipfree/certify/certified_map.h"
#include "flipfree/mesh/adjacency.h"
#include "flipfree/mesh/validate.h"
#include "flipfree/seamless/bordered/corners.h"
#include "flipfree/seamless/signature.h"

namespace flipfree::seamless {
namespace {

// Whole numbers near to given ones in a norm.
class NearestNumbers {
 public:
  // Each from the last on is the nearest to what those behind it leave (Babai 1986).
  NearestNumbers(const Eigen::VectorXd& given, const Eigen::MatrixXd& norm)
      : numbers_(given.size()), norm_(norm) {
    const Eigen::MatrixXd upper = Eigen::LLT<Eigen::MatrixXd>(norm).matrixU();
    Eigen::VectorXd off = Eigen::VectorXd::Zero(given.size());
    for (Eigen::Index i = given.size(); i-- > 0;) {
      numbers_[i] = std::round(given[i] - upper.row(i).dot(off) / upper(i, i));
      off[i] = numbers_[i] - given[i];
    }
    slope_ = 2.0 * (norm * off);
  }

  const Eigen::VectorXd& numbers() const { return numbers_; }
  // What it costs to change one number by one, the cheaper way.
  double cost(Eigen::Index i) const { return norm_(i, i) - std::abs(slope_[i]); }
  Eigen::VectorXd changed(Eigen::Index i) const {
    Eigen::VectorXd numbers = numbers_;
    numbers[i] += slope_[i] > 0.0 ? -1.0 : 1.0;
    return numbers;
  }

 private:
  Eigen::VectorXd numbers_, slope_;
  const Eigen::MatrixXd& norm_;
};

bool is_norm(const Eigen::MatrixXd& matrix) {
  return matrix.allFinite() && Eigen::LLT<Eigen::MatrixXd>(matrix).info() == Eigen::Success;
}

}  // namespace

std::optional<std::vector<Index>> near_turns(
    const std::vector<double>& angles, const Eigen::MatrixXd& norm,
    const std::function<std::string(const std::vector<Index>&)>& why) {
  const auto count = static_cast<Eigen::Index>(angles.size());
  Eigen::MatrixXd own = norm.selfadjointView<Eigen::Lower>();
  if (!is_norm(own)) own.setIdentity();
  const NearestNumbers nearest(
      Eigen::Map<const Eigen::VectorXd>(angles.data(), count) / kQuarterTurn, own);
  std::vector<Eigen::Index> order(angles.size());
  std::iota(order.begin(), order.end(), Eigen::Index{0});
  std::stable_sort(order.begin(), order.end(), [&](Eigen::Index a, Eigen::Index b) {
    return nearest.cost(a) < nearest.cost(b);
  });
  for (std::size_t i = 0; i <= order.size(); ++i) {
    std::vector<Index> turns;
    for (const double x : i == 0 ? nearest.numbers() : nearest.changed(order[i - 1]))
      turns.push_back(static_cast<Index>(x));
    if (why(turns).empty()) return turns;
  }
  return std::nullopt;
}

std::vector<Index> near_turns(const std::vector<Index>& cones, Index genus,
                              const std::vector<double>& angles, const Eigen::MatrixXd& norm) {
  std::vector<Index> any;
  const auto found = near_turns(angles, norm, [&](const std::vector<Index>& turns) {
    if (any.empty()) any = turns;
    return why_impossible(cones, genus, turns);
  });
  if (!found) {
    const std::string why = why_impossible(cones, genus, any);
    Witness witness{"empty stratum", {{"genus", {static_cast<double>(genus)}}, {"cones", {}}}};
    for (const Index k : cone_list(cones)) witness.numbers[1].second.push_back(k);
    throw_infeasible(ErrorCode::kBadAngles, why + " Move one of the cones' angles to a third one.",
                     std::move(witness));
  }
  return *found;
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
  const mesh::Adjacency& adjacency = surface.adjacency();
  for (std::size_t v = 0; v < cones.size(); ++v) {
    if (cones[v] < kNotGiven) throw_too_sharp(static_cast<VertexId>(v), cones[v]);
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

void rethrow_placed(const std::vector<FaceId>& faces, const std::vector<VertexId>& vertices) {
  const auto numbered_by = [](const std::vector<Index>& number) {
    return [&number](Index i) { return at(i) < number.size() ? number[at(i)] : kInvalid; };
  };
  const auto face = numbered_by(faces);
  const Renumbering numbers{numbered_by(vertices), face, [](Index) { return kInvalid; }};
  try {
    throw;
  } catch (const certify::CertificateFailed& failed) {
    certify::Certificate certificate = failed.certificate();
    bool refined = false;
    for (FaceId& f : certificate.failed_faces) {
      refined = refined || face(f) != f;
      f = face(f);
    }
    std::erase(certificate.failed_faces, kInvalid);
    if (refined) certify::note_refined_numbers(certificate);
    throw certify::CertificateFailed("The seamless map", std::move(certificate));
  } catch (const NotConverged& failed) {
    throw NotConverged(renumbered(failed.error(), numbers));
  } catch (const InvalidInput& failed) {
    throw InvalidInput(renumbered(failed.error(), numbers));
  } catch (const Infeasible& failed) {
    throw Infeasible(renumbered(failed.error(), numbers));
  }
}

namespace {

// Weights of vertex v of the refined surface for the corners of a face of the input that it lies
// in.
Vector3 weights_in(const mesh::Surface& input, const mesh::Provenance& provenance, VertexId v,
                   FaceId face) {
  const mesh::SurfacePoint& point = provenance.vertex[at(v)];
  if (point.face == face) return point.weight;
  Vector3 weight = Vector3::Zero();
  for (int k = 0; k < 3; ++k) {
    if (point.weight[k] == 0.0) continue;
    bool found = false;
    for (int j = 0; j < 3; ++j) {
      if (input.faces(face, j) != input.faces(point.face, k)) continue;
      weight[j] = point.weight[k];
      found = true;
    }
    if (!found) {
      throw InternalError("refined pieces: vertex " + std::to_string(v) + " lies outside face " +
                          std::to_string(face));
    }
  }
  return weight;
}

}  // namespace

void name_input_places(const mesh::Surface& input, const mesh::Provenance& provenance,
                       const Triangles& refined, certify::Parametrization& map) {
  for (std::size_t v = 0; v < map.vertex_parent.size(); ++v) {
    const FaceId fine = map.vertex_parent[v];
    const FaceId face = provenance.face[at(fine)];
    Vector3 weight = Vector3::Zero();
    for (Index k = 0; k < 3; ++k) {
      const double share = map.vertex_barycentric(static_cast<Eigen::Index>(v), k);
      if (share != 0.0) weight += share * weights_in(input, provenance, refined(fine, k), face);
    }
    map.vertex_parent[v] = face;
    map.vertex_barycentric.row(static_cast<Eigen::Index>(v)) = weight;
  }
  for (FaceId& parent : map.parent_face) parent = provenance.face[at(parent)];
}

}  // namespace flipfree::seamless
