#include "flipfree/seamless/padding/geometry/assembly.h"

#include <algorithm>
#include <cmath>
#include <queue>
#include <string>
#include <utility>

#include "flipfree/base/error.h"

namespace flipfree::seamless {
namespace {

using intrinsic::FlipMesh;

// Radians that a frame may miss a quarter turn by.
constexpr double kLargestClosingError = 1e-2;

// The flat metric of one disk as vectors, written to `out` under the names `name` (per half-edge of
// the disk).
class Development {
 public:
  Development(const HalfTriangulation& half, const std::vector<HalfedgeId>& name, FlatSurface& out)
      : half_(half), name_(name), out_(out) {
    for (std::size_t h = 0; h < half.inside.size(); ++h) {
      if (!half.inside[h]) continue;
      const auto e = static_cast<EdgeId>(h / 2);
      if (!open(static_cast<HalfedgeId>(h)) && first_ == kInvalid)
        first_ = static_cast<HalfedgeId>(h);
      largest_ = std::max(largest_, exponent(e));
    }
  }

  // Returns the closing error.
  double run(const ExecutionContext& context) {
    std::vector<char> placed(half_.inside.size(), 0);
    // Large edges first: small triangles come last, between large ones that are known.
    std::priority_queue<std::pair<std::int64_t, HalfedgeId>> front;
    const auto enter = [&](HalfedgeId h, const WideVector& side) {
      place_face(h, side);
      for (const HalfedgeId g : {h, half_.mesh.next_of(h), half_.mesh.previous(h)}) {
        placed[at(g)] = 1;
        if (open(g) && !placed[at(g ^ 1)]) front.push({exponent(g >> 1), g});
      }
    };
    enter(first_, {half_.length[at(first_ >> 1)], Wide(0.0)});
    for (std::size_t count = 0; !front.empty(); ++count) {
      if (count % 1024 == 0) context.check();
      const HalfedgeId g = front.top().second;
      front.pop();
      if (!placed[at(g ^ 1)]) enter(g ^ 1, -vector(g));
    }
    double error = 0.0;
    for (std::size_t h = 0; h < placed.size(); h += 2) {
      const auto g = static_cast<HalfedgeId>(h);
      if (half_.inside[h] && open(g)) error = std::max(error, match(g));
    }
    return error;
  }

 private:
  // Is there more of the disk beyond h?
  bool open(HalfedgeId h) const { return half_.inside[at(h)] && half_.inside[at(h ^ 1)]; }
  WideVector& vector(HalfedgeId h) { return out_.vector[at(name_[at(h)])]; }
  std::int64_t exponent(EdgeId e) const {
    std::int64_t x = 0;
    half_.length[at(e)].to_double_scaled(x);
    return x;
  }

  // The face of h, from the vector of h and the lengths.
  void place_face(HalfedgeId h, const WideVector& side) {
    const HalfedgeId n = half_.mesh.next_of(h), p = half_.mesh.next_of(n);
    const Wide &a = half_.length[at(h >> 1)], &b = half_.length[at(n >> 1)],
               &c = half_.length[at(p >> 1)];
    const Wide two(2.0);
    const Wide along = (a + ((c - b) / a) * (c + b)) / two;
    const Wide square = (a + b + c) * ((c - a) + b) * ((b - c) + a) * ((c - b) + a);
    if (square.sign() <= 0) {
      throw_not_converged(ErrorCode::kIterationLimit,
                          "The metric of a piece of the surface is not precise enough to be "
                          "padded. Spread the cones further apart, or use the engine \"penner\".");
    }
    const Wide height = sqrt(square) / (two * a);
    const Wide x = along / a, y = height / a;
    vector(h) = side;
    vector(p) = -(WideVector{x * side.x - y * side.y, x * side.y + y * side.x});
    vector(n) = -(vector(h) + vector(p));
  }

  // The quarter turns across an edge; how far from them it is.
  double match(HalfedgeId h) {
    const WideVector a = vector(h), b = -vector(h ^ 1);
    const Index t = turns_between(a, b);
    out_.turns[at(name_[at(h)])] = t;
    out_.turns[at(name_[at(h ^ 1)])] = (4 - t) & 3;
    const WideVector c = turned(a, t);
    return std::abs(numeric::ratio(cross(c, b), dot(c, b)));
  }

  const HalfTriangulation& half_;
  const std::vector<HalfedgeId>& name_;
  FlatSurface& out_;
  HalfedgeId first_ = kInvalid;
  std::int64_t largest_ = 0;
};

}  // namespace

AssembledSurface assemble(const std::vector<CutDisk>& disks, const intrinsic::IntrinsicSetup& setup,
                          const AdmissibleCut& cut, const ExecutionContext& context) {
  AssembledSurface out;
  FlatSurface& flat = out.flat;
  flat.mesh = setup.mesh;
  flat.vector.resize(flat.mesh.halfedge_count());
  flat.turns.assign(flat.mesh.halfedge_count(), 0);
  flat.fixed.assign(flat.mesh.edge_count(), 0);
  flat.axis.assign(flat.mesh.halfedge_count(), 0);
  for (const auto& branch : cut.branches) {
    for (const HalfedgeId h : branch) flat.fixed[at(setup.input_halfedge[at(h)] >> 1)] = 1;
  }
  for (const CutDisk& disk : disks) {
    const HalfTriangulation& half = disk.half;
    std::vector<HalfedgeId> name(half.home.size(), kInvalid);
    for (std::size_t h = 0; h < name.size(); ++h) {
      const HalfedgeId c = half.home[h];
      if (c != kInvalid)
        name[h] = setup.input_halfedge[at(3 * disk.chart.faces[at(c / 3)] + c % 3)];
    }
    // Backwards from home. A flip that undoes another one leaves the halves exchanged.
    for (std::size_t i = half.flips_home.size(); i-- > 0;) {
      if (i % 65536 == 65535) context.check();
      const auto e = at(half.flips_home[i]);
      intrinsic::flip_edge(flat.mesh, name[2 * e] >> 1);
      flat.flips.push_back(name[2 * e] >> 1);
      std::swap(name[2 * e], name[2 * e + 1]);
    }
    for (std::size_t h = 0; h < name.size(); ++h) {
      if (name[h] == kInvalid) continue;
      const HalfedgeId next = name[at(half.mesh.next[h])];
      if (flat.mesh.next_of(name[h]) != next)
        throw InternalError("assembly: the way home does not lead back");
    }
    out.closing_error = std::max(out.closing_error, Development(half, name, flat).run(context));
  }
  for (std::size_t h = 0; h < flat.axis.size(); ++h) {
    if (flat.fixed[h / 2]) flat.axis[h] = turns_between({Wide(1.0), Wide(0.0)}, flat.vector[h]);
  }
  if (!(out.closing_error < kLargestClosingError)) {
    throw_not_converged(ErrorCode::kIterationLimit,
                        "The metric of a piece of the surface closes only up to " +
                            std::to_string(out.closing_error) +
                            " radians. Spread the cones further apart, or use the engine "
                            "\"penner\".");
  }
  return out;
}

}  // namespace flipfree::seamless
