#include "flipfree/holonomy/combed.h"

#include <Eigen/Geometry>
#include <cmath>
#include <complex>
#include <numbers>

#include "flipfree/mesh/topology.h"

namespace flipfree::holonomy {
namespace {

// Per face of the refinement: quarter turns from its parent's direction to the one that is chosen.
std::vector<Index> choose(const Refined& refined, const mesh::EdgeFlags& cuts,
                          const mesh::Surface& input, const mesh::Adjacency& input_adjacency,
                          const std::vector<Index>& quarters) {
  std::vector<Index> turned(refined.parent_face.size(), kInvalid);
  std::vector<FaceId> queue;
  for (FaceId first = 0; at(first) < turned.size(); ++first) {
    if (turned[at(first)] != kInvalid) continue;
    turned[at(first)] = 0;
    queue.assign(1, first);
    for (std::size_t i = 0; i < queue.size(); ++i) {
      for (HalfedgeId h = 3 * queue[i]; h < 3 * queue[i] + 3; ++h) {
        const HalfedgeId o = refined.adjacency.opposite[at(h)];
        if (o == kInvalid || cuts[at(h)] != 0 || turned[at(o / 3)] != kInvalid) continue;
        const HalfedgeId side = input_halfedge(refined, input, input_adjacency, h);
        // This face's direction goes with the neighbour's, turned by so many quarters.
        const Index across = side == kInvalid ? 0 : quarters[at(side)];
        turned[at(o / 3)] = (turned[at(queue[i])] + across) % 4;
        queue.push_back(o / 3);
      }
    }
  }
  return turned;
}

// A unit vector of the face, `angle` from its first edge, in the map; any positive length.
Vector2 mapped(const mesh::Surface& surface, FaceId f, double angle, const Points2& corner_uv) {
  const Vector3 p = surface.vertices.row(surface.faces(f, 0));
  const Vector3 a = Vector3(surface.vertices.row(surface.faces(f, 1))) - p;
  const Vector3 b = Vector3(surface.vertices.row(surface.faces(f, 2))) - p;
  // b is `right` along a and `left` to the left of it.
  const double right = a.dot(b) / a.norm(), left = a.cross(b).norm() / a.norm();
  const double second = std::sin(angle) / left;
  const double first = (std::cos(angle) - second * right) / a.norm();
  return first * (corner_uv.row(3 * f + 1) - corner_uv.row(3 * f)).transpose() +
         second * (corner_uv.row(3 * f + 2) - corner_uv.row(3 * f)).transpose();
}

}  // namespace

std::vector<double> combed_directions(const Refined& refined, const mesh::EdgeFlags& cuts,
                                      const mesh::Surface& input,
                                      const mesh::Adjacency& input_adjacency,
                                      const field::CrossField& field) {
  const std::vector<Index> turned =
      choose(refined, cuts, input, input_adjacency, field::quarters_across(input_adjacency, field));
  const Points3 of_parent = field::directions_of(input, field.angle);
  Points3 own(static_cast<Eigen::Index>(turned.size()), 3);
  for (FaceId f = 0; at(f) < turned.size(); ++f)
    own.row(f) = of_parent.row(refined.parent_face[at(f)]);
  std::vector<double> angle = field::angles_of(refined.surface, own);
  for (std::size_t f = 0; f < turned.size(); ++f) angle[f] += turned[f] * 0.5 * std::numbers::pi;
  return angle;
}

void turn_towards(const Refined& refined, const std::vector<double>& direction, bool upright,
                  Points2& corner_uv) {
  const mesh::Components parts = mesh::face_components(refined.adjacency);
  std::vector<char> by_quarters(at(parts.count), 0);
  for (std::size_t h = 0; upright && h < refined.adjacency.opposite.size(); ++h) {
    if (refined.adjacency.opposite[h] == kInvalid) by_quarters[at(parts.of_face[h / 3])] = 1;
  }
  std::vector<std::complex<double>> mean(at(parts.count), 0.0);
  for (FaceId f = 0; at(f) < direction.size(); ++f) {
    const Vector2 d = mapped(refined.surface, f, direction[at(f)], corner_uv);
    const double length = d.norm();
    if (!(length > 0.0) || !std::isfinite(length)) continue;
    const Vector3 p = refined.surface.vertices.row(refined.surface.faces(f, 0));
    const Vector3 a = Vector3(refined.surface.vertices.row(refined.surface.faces(f, 1))) - p;
    const Vector3 b = Vector3(refined.surface.vertices.row(refined.surface.faces(f, 2))) - p;
    mean[at(parts.of_face[at(f)])] +=
        0.5 * a.cross(b).norm() / length * std::complex<double>(d.x(), d.y());
  }
  for (std::size_t part = 0; part < mean.size(); ++part) {
    if (by_quarters[part] == 0) continue;
    constexpr std::complex<double> kQuarters[] = {{1.0, 0.0}, {0.0, 1.0}, {-1.0, 0.0}, {0.0, -1.0}};
    const double quarters = std::arg(mean[part]) / (0.5 * std::numbers::pi);
    mean[part] = kQuarters[at(static_cast<Index>(std::lround(quarters)) & 3)];
  }
  for (CornerId c = 0; c < static_cast<CornerId>(corner_uv.rows()); ++c) {
    const std::complex<double> m = mean[at(parts.of_face[at(c / 3)])];
    if (!(std::abs(m) > 0.0)) continue;
    const std::complex<double> z =
        std::complex<double>(corner_uv(c, 0), corner_uv(c, 1)) * std::conj(m) / std::abs(m);
    corner_uv.row(c) << z.real(), z.imag();
  }
}

}  // namespace flipfree::holonomy
