#include "flipfree/intrinsic/refined_start/delaunay_refinement.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>
#include <queue>

#include "flipfree/intrinsic/refined_start/signpost_triangulation.h"

namespace flipfree::intrinsic {
namespace {

using std::numbers::pi;

constexpr double kNeedleVertex = pi / 3;  // total angle below which nothing helps

class DelaunayRefiner {
 public:
  DelaunayRefiner(const FlatSurface& surface, const RefinementOptions& options,
                  const ExecutionContext& context)
      : options_(options),
        context_(context),
        mesh_(surface),
        input_vertices_(surface.vertex_count) {}

  RefinementPoints run() {
    mesh_.restore_delaunay(context_);
    result_.smallest_angle = pi;
    requeue();
    for (const Entry& e : entries_)
      result_.smallest_angle = std::min(result_.smallest_angle, e.angle);
    std::erase_if(entries_, [&](const Entry& e) { return !is_bad(e); });
    for (const Entry& e : entries_) bad_.push(e);
    recording_ = true;
    result_.complete = true;
    while (step()) {
    }
    for (std::size_t v = at(input_vertices_); v < mesh_.vertices().size(); ++v) {
      result_.points.push_back(mesh_.vertices()[v].point);
    }
    return std::move(result_);
  }

 private:
  struct Entry {
    double radius;  // of the circumcircle
    double angle;   // the smallest
    FaceId face;
    std::uint32_t version;
    bool operator<(const Entry& o) const {
      return radius != o.radius ? radius < o.radius : face > o.face;
    }
  };

  // Triangles too degenerate to have a radius are left alone: the queue could not order them.
  bool is_bad(const Entry& e) const {
    return e.angle < options_.least_angle && std::isfinite(e.radius);
  }

  bool is_needle(VertexId v) const { return mesh_.vertex(v).total_angle < kNeedleVertex; }

  // Versions of the faces that changed; those that are bad, and boundary edges that are encroached,
  // are put in line.
  void requeue() {
    const std::vector<FaceId> changed = mesh_.take_changed();
    version_.resize(at(mesh_.face_count()), 0);
    for (const FaceId f : changed) {
      ++version_[at(f)];
      HalfedgeId h = mesh_.face_halfedge(f);
      double shortest = std::numeric_limits<double>::infinity(), product = 1.0;
      bool needle = false;
      for (int k = 0; k < 3; ++k, h = mesh_.next(h)) {
        shortest = std::min(shortest, mesh_.length(h));
        product *= mesh_.length(h);
        needle = needle || is_needle(mesh_.origin(h));
        if (mesh_.inside(h ^ 1) || is_needle(mesh_.origin(h)) || is_needle(mesh_.origin(h ^ 1)))
          continue;
        const Vector2 top = mesh_.apex(h);
        if (top.dot(top - Vector2(mesh_.length(h), 0.0)) < 0.0) encroached_.push_back(h);
      }
      if (needle) continue;
      const double area = 0.5 * mesh_.length(h) * mesh_.apex(h).y();
      const double radius = product / (4.0 * area);
      const double angle = std::asin(std::min(1.0, 0.5 * shortest / radius));
      const Entry entry{radius, angle, f, version_[at(f)]};
      if (!recording_) {
        entries_.push_back(entry);
      } else if (is_bad(entry)) {
        bad_.push(entry);
      }
    }
  }

  // One insertion. False if there is nothing left to do.
  bool step() {
    context_.check();
    const auto added = static_cast<Index>(mesh_.vertices().size()) - input_vertices_;
    if (added >= options_.max_added) {
      result_.complete = encroached_.empty() && bad_.empty();
      return false;
    }
    if (!encroached_.empty()) {
      const HalfedgeId h = encroached_.back();
      encroached_.pop_back();
      if (still_encroached(h)) split(h);
      return true;
    }
    if (bad_.empty()) return false;
    const Entry top = bad_.top();
    bad_.pop();
    if (top.version != version_[at(top.face)]) return true;
    split_face(top);
    return true;
  }

  bool still_encroached(HalfedgeId h) const {
    const Vector2 top = mesh_.apex(h);
    return top.dot(top - Vector2(mesh_.length(h), 0.0)) < 0.0;
  }

  void split(HalfedgeId h) {
    context_.check();
    mesh_.split_boundary(h);
    mesh_.restore_delaunay(context_);
    requeue();
  }

  void split_face(const Entry& entry) {
    const HalfedgeId h = mesh_.face_halfedge(entry.face);
    const Vector2 top = mesh_.apex(h);
    const double l = mesh_.length(h);
    // The circumcentre lies on the bisector of h, as far from the origin as from the apex.
    const Vector2 centre{0.5 * l, 0.5 * (top.squaredNorm() - l * top.x()) / top.y()};
    if (!centre.allFinite()) return;
    const SignpostTriangulation::Place place = mesh_.locate(h, centre);
    if (place.crossed_boundary != kInvalid) {
      stopped_at_.assign(1, place.crossed_boundary);
    } else if (place.h == kInvalid) {
      return;
    } else {
      mesh_.encroached_by(place, stopped_at_);
    }
    if (stopped_at_.empty()) {
      if (!mesh_.insert(place)) return;
      mesh_.restore_delaunay(context_);
      requeue();
      return;
    }
    bool any = false;
    for (const HalfedgeId edge : std::vector<HalfedgeId>(stopped_at_)) {
      if (is_needle(mesh_.origin(edge)) || is_needle(mesh_.origin(edge ^ 1))) continue;
      split(edge);
      any = true;
    }
    // The triangle may be as it was: its turn comes again.
    if (any && version_[at(entry.face)] == entry.version) bad_.push(entry);
  }

  const RefinementOptions& options_;
  const ExecutionContext& context_;
  SignpostTriangulation mesh_;
  Index input_vertices_;
  RefinementPoints result_;
  std::vector<Entry> entries_;  // of the start
  bool recording_ = false;      // bad triangles go to the queue
  std::priority_queue<Entry> bad_;
  std::vector<std::uint32_t> version_;
  std::vector<HalfedgeId> encroached_, stopped_at_;
};

}  // namespace

RefinementPoints find_refinement_points(const FlatSurface& surface,
                                        const RefinementOptions& options,
                                        const ExecutionContext& context) {
  return DelaunayRefiner(surface, options, context).run();
}

}  // namespace flipfree::intrinsic
