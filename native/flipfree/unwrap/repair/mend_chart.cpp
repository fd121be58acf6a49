#include "flipfree/unwrap/repair/mend_chart.h"

#include <algorithm>
#include <utility>

#include "flipfree/base/failure.h"
#include "flipfree/base/plane.h"
#include "flipfree/distortion/energy/energy.h"
#include "flipfree/distortion/minimize/boundary_barrier.h"
#include "flipfree/mesh/own_unit.h"
#include "flipfree/numeric/predicates.h"
#include "flipfree/unwrap/chart/apart/draw_apart.h"
#include "flipfree/unwrap/chart/chart.h"
#include "flipfree/unwrap/chart/flattening.h"
#include "flipfree/unwrap/chart/overlapping_faces.h"
#include "flipfree/unwrap/chart/separate.h"
#include "flipfree/unwrap/packing/layout.h"
#include "flipfree/unwrap/repair/patches/damage.h"
#include "flipfree/unwrap/repair/patches/patches.h"

namespace flipfree::unwrap {
namespace {

// A chart with so much of its area in positive faces has a size and a place.
constexpr double kEnoughHealthy = 0.3;
// A chart that lies on itself with less of its area is first relaxed where it does.
constexpr double kLittleOverlap = 0.1;
// A flipped or mirrored chart so much larger or smaller than the others has no size to keep.
constexpr double kOddSize = 5.0;
// Mean energy of a mirrored chart that is not worth turning over.
constexpr double kMostMirroredEnergy = 5.0;

class ChartMender {
 public:
  ChartMender(const ChartToMend& given, const RepairOptions& options, ExecutionContext& context)
      : given_(given),
        options_(options),
        context_(context),
        own_(given.chart.surface),
        faces_(given.chart.surface.faces),
        adjacency_(
            mesh::build_adjacency(static_cast<Index>(given.chart.surface.vertices.rows()), faces_)),
        damaged_{own_.surface(), adjacency_, face_areas(own_.surface()), given.unknown,
                 std::vector<char>(given.unknown.size(), 0)} {
    for (const auto& [v, uv] : given.pins) damaged_.pinned[at(v)] = 1;
  }

  MendedChart run(bool anew) {
    Points2 uv = given_.places;
    const bool flipped_only = mirror(uv);
    find_density(uv);
    const Points2 before = uv;
    if (anew || !(damaged_.density > 0.0) || !has_border()) {
      flatten(before);
      return std::move(result_);
    }
    const std::vector<double> energies = face_energies(own_.surface(), uv, damaged_.density);
    const bool bad = find_damage(damaged_, uv, energies, healthy_energy(damaged_.area, energies),
                                 false, context_)
                         .count > 0;
    const bool odd = has_odd_size();
    const bool poor = flipped_only && mean_of(energies) > kMostMirroredEnergy;
    if (((bad || flipped_only) && odd) || poor) {
      if (odd) damaged_.density = given_.density * own_.unit();
      flatten(before);
      return std::move(result_);
    }
    if (flipped_only) result_.change = Change::kMirrored;
    if (bad || (options_.overlaps != SelfOverlaps::kKeep && overlaps(uv))) {
      if (!mend_in_place(damaged_, uv, context_) && bad) {
        flatten(before);
        return std::move(result_);
      }
      if (uv != before) result_.change = Change::kUnfolded;
    }
    take(uv);
    if (options_.overlaps != SelfOverlaps::kKeep) part_from_itself(before, uv);
    return std::move(result_);
  }

 private:
  bool has_border() const {
    return std::find(adjacency_.opposite.begin(), adjacency_.opposite.end(), kInvalid) !=
           adjacency_.opposite.end();
  }

  bool overlaps(const Points2& uv) const {
    return distortion::overlaps_itself(
        distortion::find_boundary(static_cast<Index>(uv.rows()), faces_), uv, context_);
  }

  // A chart that is wrong side up as a whole; with pins it cannot be turned over.
  bool mirror(Points2& uv) const {
    if (!given_.pins.empty()) return false;
    Index right = 0;
    Index wrong = 0;
    for (FaceId f = 0; f < faces_.rows(); ++f) {
      const auto corner = [&](Index k) { return uv.row(faces_(f, k)).data(); };
      const int side = numeric::orientation(corner(0), corner(1), corner(2));
      right += side > 0;
      wrong += side < 0;
    }
    if (wrong <= right) return false;
    const double sum = uv.col(0).minCoeff() + uv.col(0).maxCoeff();
    uv.col(0) = sum - uv.col(0).array();
    return true;
  }

  void find_density(const Points2& uv) {
    const Density own = density_of(own_.surface(), damaged_.area, uv, damaged_.unknown);
    healthy_place_ = own.share >= kEnoughHealthy;
    const bool pinned = own.value > 0.0 && !given_.pins.empty();
    damaged_.density = healthy_place_ || pinned ? own.value : given_.density * own_.unit();
    result_.has_density = damaged_.density > 0.0;
  }

  bool has_odd_size() const {
    const double ratio = damaged_.density / (given_.density * own_.unit());
    return given_.pins.empty() && given_.density > 0.0 &&
           (ratio > kOddSize || kOddSize * ratio < 1.0);
  }

  double mean_of(const std::vector<double>& energies) const {
    double sum = 0.0;
    double area = 0.0;
    for (std::size_t f = 0; f < energies.size(); ++f) {
      sum += damaged_.area[f] * energies[f];
      area += damaged_.area[f];
    }
    return sum / area;
  }

  void take(const Points2& uv) {
    result_.uv.resize(faces_.size(), 2);
    for (CornerId c = 0; c < static_cast<CornerId>(faces_.size()); ++c)
      result_.uv.row(c) = uv.row(faces_.data()[c]);
    result_.place.assign(at(static_cast<Index>(faces_.rows())), Place::kStays);
    result_.remade.assign(result_.place.size(), 0);
  }

  // The whole chart, as an unwrap maps it, at its former size, direction and place.
  void flatten(const Points2& before) {
    result_.change = Change::kAnew;
    const mesh::Surface& surface = own_.surface();
    std::vector<certify::CornerPin> pins;
    for (CornerId c = 0; c < static_cast<CornerId>(faces_.size()); ++c) {
      const VertexId v = faces_.data()[c];
      if (damaged_.pinned[at(v)] != 0) pins.push_back({c, given_.places.row(v).transpose()});
    }
    UnwrapOptions unwrapping;
    unwrapping.may_add_cuts = options_.overlaps != SelfOverlaps::kOpen;
    unwrapping.max_iterations = options_.max_iterations;
    unwrapping.tolerance = options_.tolerance;
    Opening opening;
    if (!pins.empty()) opening.pinned = pinned_vertices(surface, pins);
    Islands islands = make_islands(surface, adjacency_, given_.seams, given_.uncuttable,
                                   pins.empty(), context_, opening);
    const ChartPins chart_pins = pins_by_chart(islands, pins);
    Stats ignored;
    std::vector<Points2> flat = flatten_islands(islands, surface, adjacency_, given_.uncuttable,
                                                chart_pins, unwrapping, false, context_, ignored);
    result_.cut = islands.cut;
    result_.uv.resize(faces_.size(), 2);
    result_.place.assign(at(static_cast<Index>(faces_.rows())), Place::kStays);
    result_.remade.assign(result_.place.size(), 0);
    const ChartPins of_pieces = pins_by_chart(islands, pins);
    for (std::size_t c = 0; c < islands.charts.size(); ++c) {
      const mesh::Chart& piece = islands.charts[c];
      const bool free = of_pieces.of_chart[c].empty();
      const Place place = free ? put_back(islands, c, before, flat[c]) : Place::kStays;
      for (std::size_t h = 0; h < 3 * piece.faces.size(); ++h) {
        const FaceId f = piece.faces[h / 3];
        result_.place[at(f)] = place;
        result_.remade[at(f)] = free;
        result_.uv.row(3 * f + static_cast<Index>(h % 3)) =
            flat[c].row(piece.surface.faces.data()[h]);
      }
    }
  }

  // Scales a piece to the chart's density, and moves it to where its open faces were, if most of it
  // was open.
  Place put_back(const Islands& islands, std::size_t c, const Points2& before, Points2& uv) const {
    if (!(damaged_.density > 0.0)) {
      uv *= own_.unit();
      return Place::kNone;
    }
    const mesh::Chart& piece = islands.charts[c];
    const double own = density_of(piece.surface, face_areas(piece.surface), uv).value;
    uv *= damaged_.density / (own > 0.0 ? own : 1.0);
    std::vector<char> open(piece.vertices.size(), 0);
    const auto origin = [&](VertexId v) {
      return islands.mesh.vertex_origin[at(piece.vertices[at(v)])];
    };
    double area = 0.0;
    double healthy = 0.0;
    for (FaceId f = 0; f < piece.surface.faces.rows(); ++f) {
      const auto corner = [&](Index k) {
        return before.row(origin(piece.surface.faces(f, k))).data();
      };
      const double own = damaged_.area[at(piece.faces[at(f)])];
      area += own;
      if (numeric::orientation(corner(0), corner(1), corner(2)) <= 0) continue;
      healthy += own;
      for (Index k = 0; k < 3; ++k) open[at(piece.surface.faces(f, k))] = 1;
    }
    const auto count = static_cast<Eigen::Index>(std::count(open.begin(), open.end(), 1));
    if (!healthy_place_ || healthy < kEnoughHealthy * area || count == 0) return Place::kNone;
    Points2 from(count, 2);
    Points2 to(count, 2);
    Eigen::Index row = 0;
    for (std::size_t v = 0; v < open.size(); ++v) {
      if (open[v] == 0) continue;
      from.row(row) = uv.row(static_cast<Eigen::Index>(v));
      to.row(row++) = before.row(origin(static_cast<VertexId>(v)));
    }
    Points2 placed = moved(fit_motion(from, to), uv);
    // A direction that costs a flip by rounding is given up.
    if (!distortion::is_flip_free(piece.surface.faces, placed, context_)) return Place::kNone;
    uv = std::move(placed);
    return Place::kWhereItWas;
  }

  // `uv` is flip-free.
  void part_from_itself(const Points2& before, Points2& uv) {
    if (!overlaps(uv)) return;
    std::vector<FacePair> pairs = overlapping_faces(faces_, uv, context_);
    if (relax_overlap(pairs, uv)) {
      result_.change = Change::kUnfolded;
      take(uv);
      return;
    }
    if (options_.overlaps == SelfOverlaps::kOpen || pairs.empty() || !cut_apart(pairs, uv)) {
      result_ = {};
      flatten(before);
    }
  }

  // Where a little of the chart is drawn over the rest.
  bool relax_overlap(const std::vector<FacePair>& pairs, Points2& uv) {
    double over = 0.0;
    double area = 0.0;
    for (FaceId f = 0; f < faces_.rows(); ++f) area += uv_area(uv, f);
    for (const FacePair& pair : pairs) over += pair.area;
    if (over > kLittleOverlap * area) return false;
    const std::vector<double> energies = face_energies(own_.surface(), uv, damaged_.density);
    std::vector<char> flagged(energies.size(), 0);
    for (const FacePair& pair : pairs)
      flagged[at(energies[at(pair.first)] > energies[at(pair.second)] ? pair.first : pair.second)] =
          1;
    if (pairs.empty()) flag_touching(uv, flagged);
    for (const Index rings : {0, 2}) {
      Points2 apart = relaxed_around(damaged_, flagged, rings, uv, context_);
      if (overlaps(apart)) continue;
      uv = std::move(apart);
      return true;
    }
    return false;
  }

  // Faces at vertices that lie on each other.
  void flag_touching(const Points2& uv, std::vector<char>& flagged) const {
    const distortion::Boundary boundary =
        distortion::find_boundary(static_cast<Index>(uv.rows()), faces_);
    std::vector<VertexId> sorted = boundary.vertices;
    std::sort(sorted.begin(), sorted.end(), [&](VertexId a, VertexId b) {
      return uv(a, 0) != uv(b, 0) ? uv(a, 0) < uv(b, 0) : uv(a, 1) < uv(b, 1);
    });
    std::vector<char> touching(at(static_cast<Index>(uv.rows())), 0);
    for (std::size_t i = 1; i < sorted.size(); ++i) {
      if (uv.row(sorted[i - 1]) == uv.row(sorted[i])) touching[at(sorted[i])] = 1;
    }
    for (FaceId f = 0; f < faces_.rows(); ++f) {
      for (Index k = 0; k < 3; ++k) flagged[at(f)] |= touching[at(faces_(f, k))];
    }
  }

  double uv_area(const Points2& uv, FaceId f) const {
    const auto corner = [&](Index k) -> Vector2 { return uv.row(faces_(f, k)).transpose(); };
    return 0.5 * twice_area(corner(0), corner(1), corner(2));
  }

  // The largest piece and those with pins stay, the others go to where there is room, as they are.
  bool cut_apart(const std::vector<FacePair>& pairs, const Points2& uv) {
    mesh::EdgeFlags cut =
        separating_cut(own_.surface(), adjacency_, uv, pairs, 0.0, given_.uncuttable, context_);
    if (std::find(cut.begin(), cut.end(), 1) == cut.end()) return false;
    const mesh::CutMesh mesh = mesh::cut_along(faces_, adjacency_, cut);
    const std::vector<mesh::Chart> pieces = mesh::split_into_charts(own_.surface().vertices, mesh);
    std::size_t largest = 0;
    double most = -1.0;
    std::vector<char> pinned(pieces.size(), 0);
    for (std::size_t p = 0; p < pieces.size(); ++p) {
      double area = 0.0;
      for (const FaceId f : pieces[p].faces) area += uv_area(uv, f);
      for (const VertexId v : pieces[p].vertices)
        pinned[p] |= damaged_.pinned[at(mesh.vertex_origin[at(v)])];
      if (area <= most) continue;
      most = area;
      largest = p;
    }
    take(uv);
    for (std::size_t p = 0; p < pieces.size(); ++p) {
      const mesh::Chart& piece = pieces[p];
      Points2 own(piece.surface.vertices.rows(), 2);
      for (Eigen::Index v = 0; v < own.rows(); ++v)
        own.row(v) = uv.row(mesh.vertex_origin[at(piece.vertices[static_cast<std::size_t>(v)])]);
      const bool apart = draw_apart(piece.surface.faces, own, context_);
      if (!apart) return false;
      const Place place = pinned[p] != 0 || p == largest ? Place::kStays : Place::kNone;
      for (std::size_t h = 0; h < 3 * piece.faces.size(); ++h) {
        const FaceId f = piece.faces[h / 3];
        result_.place[at(f)] = place;
        result_.uv.row(3 * f + static_cast<Index>(h % 3)) = own.row(piece.surface.faces.data()[h]);
      }
    }
    result_.cut = std::move(cut);
    result_.was_cut = true;
    return true;
  }

  const ChartToMend& given_;
  const RepairOptions& options_;
  ExecutionContext& context_;
  const mesh::InOwnUnit own_;
  const Triangles& faces_;
  const mesh::Adjacency adjacency_;
  DamagedChart damaged_;
  bool healthy_place_ = false;
  MendedChart result_;
};

Error in_terms_of_surface(Error error, const ChartToMend& given) {
  const mesh::Chart& chart = given.chart;
  const auto known = [](Index i, std::size_t count) { return i >= 0 && at(i) < count; };
  const Renumbering numbers{
      [&](Index v) {
        return known(v, chart.vertices.size()) ? given.vertex_origin[at(chart.vertices[at(v)])]
                                               : kInvalid;
      },
      [&](Index f) { return known(f, chart.faces.size()) ? chart.faces[at(f)] : kInvalid; },
      [&](Index c) {
        return known(c / 3, chart.faces.size()) ? 3 * chart.faces[at(c / 3)] + c % 3 : kInvalid;
      }};
  error.message = renumbered(error.message, numbers);
  error.kind = ElementKind::kFace;
  error.elements = {chart.faces.front()};
  return error;
}

}  // namespace

ChartDensity own_density(const mesh::Chart& chart, const Points2& places) {
  const mesh::InOwnUnit own(chart.surface);
  const std::vector<double> areas = face_areas(own.surface());
  const Density density = density_of(own.surface(), areas, places);
  if (density.share < kEnoughHealthy) return {};
  double area = 0.0;
  for (const double a : areas) area += a;
  return {density.value / own.unit(), density.share * area * own.unit() * own.unit()};
}

double common_density(const std::vector<mesh::Chart>& charts, const std::vector<Points2>& places) {
  std::vector<std::pair<double, double>> known;
  for (std::size_t c = 0; c < charts.size(); ++c) {
    const ChartDensity own = own_density(charts[c], places[c]);
    if (own.value > 0.0 && own.area > 0.0) known.emplace_back(own.value, own.area);
  }
  return weighted_median(std::move(known));
}

MendedChart mend_chart(const ChartToMend& given, const RepairOptions& options, bool anew,
                       ExecutionContext& context) {
  return with_errors([&](Error error) { return in_terms_of_surface(std::move(error), given); },
                     [&] { return ChartMender(given, options, context).run(anew); });
}

}  // namespace flipfree::unwrap
