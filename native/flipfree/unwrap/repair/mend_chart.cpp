#include "flipfree/unwrap/repair/mend_chart.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "flipfree/base/failure.h"
#include "flipfree/base/plane.h"
#include "flipfree/certify/measures.h"
#include "flipfree/distortion/energy/energy.h"
#include "flipfree/distortion/minimize/boundary_barrier.h"
#include "flipfree/distortion/minimize/minimize.h"
#include "flipfree/distortion/valid_map.h"
#include "flipfree/mesh/face_area.h"
#include "flipfree/numeric/predicates.h"
#include "flipfree/unwrap/chart/chart.h"
#include "flipfree/unwrap/chart/separate.h"
#include "flipfree/unwrap/islands/islands.h"
#include "flipfree/unwrap/packing/layout.h"
#include "flipfree/unwrap/repair/given_map.h"
#include "flipfree/unwrap/repair/patches.h"
#include "flipfree/unwrap/seams/search.h"

namespace flipfree::unwrap {
namespace {

// A chart with so much of its area in positive faces has a size and a place.
constexpr double kEnoughHealthy = 0.3;
// A flipped or mirrored chart so much larger or smaller than the others has no size to keep.
constexpr double kOddSize = 5.0;
// Mean energy of a mirrored chart that is not worth turning over.
constexpr double kMostMirroredEnergy = 5.0;

// What the whole falls into along `cut` (empty: nothing), with its parts of the map (#V x 2).
std::vector<Piece> pieces_of(const mesh::Surface& whole, const mesh::EdgeFlags& cut,
                             const Points2& uv) {
  const mesh::CutMesh mesh =
      mesh::cut_along(whole.faces, whole.adjacency(),
                      cut.empty() ? mesh::EdgeFlags(at(whole.faces.size()), 0) : cut);
  std::vector<Piece> pieces;
  for (mesh::Chart& chart : mesh::split_into_charts(whole.vertices, mesh)) {
    for (VertexId& v : chart.vertices) v = mesh.vertex_origin[at(v)];
    Points2 own = uv(chart.vertices, Eigen::all);
    pieces.push_back({std::move(chart), std::move(own)});
  }
  return pieces;
}

// Turns and moves a map so that its points `from` come near `to`; what a flip by rounding costs
// that direction has no place.
Place put_near(const Triangles& faces, const Points2& from, const Points2& to, Points2& uv,
               const ExecutionContext& context) {
  Points2 placed = moved(fit_motion(from, to), uv);
  if (!distortion::is_flip_free(faces, placed, context)) return Place::kNone;
  uv = std::move(placed);
  return Place::kWhereItWas;
}

// Exact: positive, 0, or negative.
int side_of(const Triangles& faces, const Points2& uv, FaceId f) {
  return numeric::orientation(uv.row(faces(f, 0)).data(), uv.row(faces(f, 1)).data(),
                              uv.row(faces(f, 2)).data());
}

class ChartMender {
 public:
  ChartMender(const ChartToMend& given, const RepairOptions& options, ExecutionContext& context)
      : given_(given),
        options_(options),
        context_(context),
        own_(given.chart.surface),
        faces_(given.chart.surface.faces),
        adjacency_(given.chart.surface.adjacency()),
        damaged_{own_.surface(), adjacency_, face_areas(own_.surface()), given.unknown,
                 std::vector<char>(given.unknown.size(), 0)} {
    for (const auto& [v, uv] : given.pins) damaged_.pinned[at(v)] = 1;
  }

  MendedChart run(bool anew) {
    Points2 uv = given_.places;
    const bool flipped_only = mirror(uv);
    find_density(uv);
    const Points2 before = uv;
    const bool can_keep = !anew && damaged_.density > 0.0 && has_border() &&
                          unfolds(uv, flipped_only) && parted_from_itself(uv);
    if (!can_keep) flatten(before);
    return std::move(result_);
  }

 private:
  // Mends in place what is damaged; false if the chart has to be made anew.
  bool unfolds(Points2& uv, bool flipped_only) {
    const Points2 before = uv;
    const std::vector<double> energies = face_energies(own_.surface(), uv, damaged_.density);
    const bool bad = any_flag(find_damage(
        damaged_, uv, energies, healthy_energy(damaged_.area, energies), false, context_));
    const bool odd = has_odd_size();
    if (flipped_only && mean_of(energies) > kMostMirroredEnergy && !odd) return false;
    if ((bad || flipped_only) && odd) {
      damaged_.density = given_.density * own_.unit();
      return false;
    }
    if (flipped_only) result_.change = Change::kMirrored;
    if (bad || (options_.overlaps != SelfOverlaps::kKeep && overlaps(uv))) {
      if (!mend_in_place(damaged_, uv, context_) && bad) return false;
      if (uv != before) result_.change = Change::kUnfolded;
    }
    result_.pieces = pieces_of(given_.chart.surface, {}, uv);
    return true;
  }

  bool has_border() const {
    return std::find(adjacency_.opposite.begin(), adjacency_.opposite.end(), kInvalid) !=
           adjacency_.opposite.end();
  }

  bool overlaps(const Points2& uv) const { return overlaps_itself(faces_, uv, context_); }

  // A chart that is wrong side up as a whole; with pins it cannot be turned over.
  bool mirror(Points2& uv) const {
    if (!given_.pins.empty()) return false;
    Index right = 0;
    Index wrong = 0;
    for (FaceId f = 0; f < faces_.rows(); ++f) {
      const int side = side_of(faces_, uv, f);
      right += side > 0;
      wrong += side < 0;
    }
    if (wrong <= right) return false;
    const double sum = uv.col(0).minCoeff() + uv.col(0).maxCoeff();
    uv.col(0) = sum - uv.col(0).array();
    return true;
  }

  void find_density(const Points2& uv) {
    const Density own = density_of(own_.surface(), uv, damaged_.unknown);
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
    const std::vector<double>& area = damaged_.area;
    return std::inner_product(area.begin(), area.end(), energies.begin(), 0.0) /
           std::accumulate(area.begin(), area.end(), 0.0);
  }

  // The whole chart, as an unwrap maps it, at its former size, direction and place.
  void flatten(const Points2& before) {
    const bool has_density = result_.has_density;
    result_ = {};
    result_.has_density = has_density;
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
    unwrapping.acceptable = false;
    Islands islands = make_islands(surface, given_.seams, given_.uncuttable, context_,
                                   {.pinned = pinned_vertices(surface, pins)});
    if (pins.empty()) slit_to_extremities(islands, surface, given_.uncuttable, context_);
    Stats ignored;
    std::vector<Points2> flat =
        flatten_islands(islands, surface, given_.uncuttable, pins_by_chart(islands, pins),
                        unwrapping, context_, ignored);
    const ChartPins of_pieces = pins_by_chart(islands, pins);
    for (std::size_t c = 0; c < islands.charts.size(); ++c) {
      mesh::Chart& piece = islands.charts[c];
      for (VertexId& v : piece.vertices) v = islands.mesh.vertex_origin[at(v)];
      const bool free = of_pieces[c].empty();
      const Place place = free ? put_back(piece, before, flat[c]) : Place::kStays;
      piece.surface.vertices = given_.chart.surface.vertices(piece.vertices, Eigen::all);
      result_.pieces.push_back({std::move(piece), std::move(flat[c]), place, free});
    }
    result_.cut = std::move(islands.cut);
  }

  // Scales a piece to the chart's density, and moves it to where its open faces were, if most of it
  // was open.
  Place put_back(const mesh::Chart& piece, const Points2& before, Points2& uv) const {
    if (!(damaged_.density > 0.0)) {
      uv *= own_.unit();
      return Place::kNone;
    }
    const double density = density_of(piece.surface, uv).value;
    uv *= damaged_.density / (density > 0.0 ? density : 1.0);
    const Points2 there = before(piece.vertices, Eigen::all);
    std::vector<VertexId> open;
    double area = 0.0;
    double healthy = 0.0;
    for (FaceId f = 0; f < piece.surface.faces.rows(); ++f) {
      const double own = damaged_.area[at(piece.faces[at(f)])];
      area += own;
      if (side_of(piece.surface.faces, there, f) <= 0) continue;
      healthy += own;
      for (const VertexId v : piece.surface.faces.row(f)) open.push_back(v);
    }
    if (!healthy_place_ || healthy < kEnoughHealthy * area || open.empty()) return Place::kNone;
    sort_unique(open);
    return put_near(piece.surface.faces, uv(open, Eigen::all), there(open, Eigen::all), uv,
                    context_);
  }

  // `uv` is flip-free. False if it lies on itself and cannot be cut.
  bool parted_from_itself(const Points2& uv) {
    if (options_.overlaps == SelfOverlaps::kKeep || !overlaps(uv)) return true;
    const std::vector<FacePair> pairs = overlapping_faces(faces_, uv, context_);
    return options_.overlaps != SelfOverlaps::kOpen && !pairs.empty() && cut_apart(pairs, uv);
  }

  // The largest piece and those with pins stay, the others go to where there is room, as they are.
  bool cut_apart(const std::vector<FacePair>& pairs, const Points2& uv) {
    mesh::EdgeFlags cut =
        separating_cut(own_.surface(), uv, pairs, 0.0, given_.uncuttable, context_);
    if (!any_flag(cut)) return false;
    std::vector<Piece> pieces = pieces_of(given_.chart.surface, cut, uv);
    Piece* largest = pieces.data();
    double most = -1.0;
    for (Piece& piece : pieces) {
      const Triangles& faces = piece.chart.surface.faces;
      if (overlaps_itself(faces, piece.uv, context_)) return false;
      const double area = uv_area(faces, piece.uv);
      if (area > most) largest = &piece;
      most = std::max(most, area);
      const std::vector<VertexId>& vertices = piece.chart.vertices;
      const bool pinned = std::any_of(vertices.begin(), vertices.end(),
                                      [&](VertexId v) { return damaged_.pinned[at(v)] != 0; });
      piece.place = pinned ? Place::kStays : Place::kNone;
    }
    largest->place = Place::kStays;
    result_.pieces = std::move(pieces);
    result_.cut = std::move(cut);
    result_.was_cut = true;
    return true;
  }

  const ChartToMend& given_;
  const RepairOptions& options_;
  ExecutionContext& context_;
  const mesh::InOwnUnit own_;
  const Triangles& faces_;
  const mesh::Adjacency& adjacency_;
  DamagedChart damaged_;
  bool healthy_place_ = false;
  MendedChart result_;
};

Error in_terms_of_surface(Error error, const ChartToMend& given) {
  error = renumbered(std::move(error), numbers_of(given.chart, given.vertex_origin));
  error.kind = ElementKind::kFace;
  error.elements = {given.chart.faces.front()};
  return error;
}

}  // namespace

double common_density(const std::vector<mesh::Chart>& charts, const std::vector<Points2>& places) {
  std::vector<std::pair<double, double>> known;
  for (std::size_t c = 0; c < charts.size(); ++c) {
    const Density density = density_of(charts[c].surface, places[c]);
    if (density.share >= kEnoughHealthy && density.value > 0.0 && density.area > 0.0)
      known.emplace_back(density.value, density.area);
  }
  return weighted_percentile(std::move(known));
}

MendedChart mend_chart(const ChartToMend& given, const RepairOptions& options, bool anew,
                       ExecutionContext& context) {
  return with_errors([&](Error error) { return in_terms_of_surface(std::move(error), given); },
                     [&] { return ChartMender(given, options, context).run(anew); });
}

namespace {

double energy_in_own_unit(const mesh::Surface& surface, const Points2& uv) {
  const mesh::InOwnUnit own(surface);
  return certify::symmetric_dirichlet(own.surface(), by_corner(surface.faces, uv)).mean;
}

// UV length per surface length that a map was meant to have: the median of its faces by area, or
// `usual` where a twentieth of them has less and a twentieth more: drawn out as they are, they do
// not tell it well.
double meant_density(const mesh::Surface& surface, const Points2& uv, double usual) {
  const mesh::InOwnUnit own(surface);
  const std::vector<double> areas = face_areas(own.surface());
  std::vector<std::pair<double, double>> ratios;  // and area
  double total = 0.0;
  for (FaceId f = 0; f < surface.faces.rows(); ++f) {
    const double ratio = uv_area(surface.faces, uv, f) / areas[at(f)];
    if (!std::isfinite(ratio)) continue;
    ratios.emplace_back(ratio, areas[at(f)]);
    total += areas[at(f)];
  }
  const double scaled = usual * own.unit();
  double below = 0.0;
  for (const auto& [ratio, area] : ratios) below += ratio <= scaled * scaled ? area : 0.0;
  constexpr double kFew = 0.05;
  const bool among = below >= kFew * total && below <= (1.0 - kFew) * total;
  return among ? usual : density_of(surface, uv).value;
}

class Judgement {
 public:
  Judgement(const ChartToMend& given, const RepairOptions& options, MendedChart& mended,
            ExecutionContext& context)
      : given_(given), options_(options), mended_(mended), context_(context) {}

  void run() {
    std::vector<Piece> judged;
    for (const Piece& piece : mended_.pieces)
      for (Piece& part : judge(piece)) judged.push_back(std::move(part));
    mended_.pieces = std::move(judged);
  }

 private:
  // The piece, or what takes its place.
  std::vector<Piece> judge(const Piece& piece) {
    const mesh::Surface& surface = piece.chart.surface;
    const double energy = energy_in_own_unit(surface, piece.uv);
    // No map's energy is below 1.
    if (!(energy > kStretchedRatio)) return {piece};
    const bool count_only = options_.stretched != StretchedIslands::kImprove;
    if (count_only && surface.faces.rows() > kMostJudged) return {piece};
    const VertexPins pins = pins_of(piece);
    bool holds_pins = true;
    Outcome<MendedChart> anew = unwrapped(piece, pins);
    if (!anew && !pins.empty()) {
      holds_pins = false;
      anew = unwrapped(piece, {});
    }
    if (!anew) return {piece};  // nothing to compare with
    const double bound = kStretchedRatio * energy_of_all(anew->pieces);
    if (energy <= bound) return {piece};
    if (count_only) {
      ++mended_.stretched.left;
      return {piece};
    }
    Piece better = piece;
    better.uv = improved_in_place(piece, pins);
    const double now = energy_in_own_unit(surface, better.uv);
    if (now > bound && holds_pins) {
      ++mended_.stretched.anew;
      return parts_of(piece, std::move(*anew));
    }
    mended_.stretched.left += now > bound;
    if (!(now < energy)) return {piece};
    ++mended_.stretched.improved;
    better.before = piece.uv;
    put_where_it_was(piece, pins.empty(), better);
    return {better};
  }

  VertexPins pins_of(const Piece& piece) const {
    VertexPins pins;
    const std::vector<VertexId>& vertices = piece.chart.vertices;
    for (std::size_t v = 0; v < vertices.size(); ++v) {
      const auto found = std::lower_bound(
          given_.pins.begin(), given_.pins.end(), vertices[v],
          [](const std::pair<VertexId, Vector2>& pin, VertexId w) { return pin.first < w; });
      if (found == given_.pins.end() || found->first != vertices[v]) continue;
      pins.emplace_back(static_cast<VertexId>(v), found->second);
    }
    return pins;
  }

  Outcome<MendedChart> unwrapped(const Piece& piece, const VertexPins& pins) const {
    const std::vector<char> known(piece.chart.vertices.size(), 0);
    const ChartToMend whole{piece.chart,
                            given_.chart.vertices,
                            piece.uv,
                            known,
                            pins,
                            part_of(piece.chart, given_.seams),
                            part_of(piece.chart, given_.uncuttable),
                            given_.density};
    return attempt([&] { return mend_chart(whole, options_, true, context_); });
  }

  // Each part at its own best scale.
  static double energy_of_all(const std::vector<Piece>& parts) {
    double sum = 0.0;
    double total = 0.0;
    for (const Piece& part : parts) {
      const double area = mesh::area_of(part.chart.surface);
      if (!(area > 0.0)) continue;
      sum += area * energy_in_own_unit(part.chart.surface, part.uv);
      total += area;
    }
    return total > 0.0 ? sum / total : std::numeric_limits<double>::infinity();
  }

  // As it was where that fails.
  Points2 improved_in_place(const Piece& piece, const VertexPins& pins) const {
    const mesh::InOwnUnit own(piece.chart.surface);
    distortion::MinimizeOptions minimize;
    minimize.max_iterations = options_.max_iterations;
    minimize.tolerance = options_.tolerance;
    minimize.bijective = !overlaps_itself(own.surface().faces, piece.uv, context_);
    for (const auto& [v, uv] : pins) minimize.fixed.push_back(v);
    auto improved = attempt([&] {
      return distortion::with_own_map([&] {
        return distortion::minimize_distortion(own.surface(), piece.uv, minimize, context_);
      });
    });
    return improved ? std::move(improved->uv) : piece.uv;
  }

  // The pieces of the piece as those of the whole.
  std::vector<Piece> parts_of(const Piece& piece, MendedChart anew) {
    for (Piece& part : anew.pieces) {
      part.before = piece.uv(part.chart.vertices, Eigen::all);
      for (FaceId& f : part.chart.faces) f = piece.chart.faces[at(f)];
      for (VertexId& v : part.chart.vertices) v = piece.chart.vertices[at(v)];
      put_where_it_was(piece, pins_of(part).empty(), part);
    }
    if (!anew.cut.empty() && mended_.cut.empty()) mended_.cut.assign(corner_count(given_.chart), 0);
    for (std::size_t h = 0; h < anew.cut.size(); ++h)
      mended_.cut[corner_of(piece.chart, h)] |= anew.cut[h];
    return std::move(anew.pieces);
  }

  // A part of the piece that is free of pins: at the piece's size, where it was.
  void put_where_it_was(const Piece& piece, bool free, Piece& part) const {
    part.place = Place::kStays;
    part.remade = free;
    if (!free) return;
    const mesh::Surface& surface = part.chart.surface;
    const double density = meant_density(piece.chart.surface, piece.uv, given_.density);
    const double own = density_of(surface, part.uv).value;
    part.place = Place::kNone;
    if (!(density > 0.0) || !(own > 0.0)) return;
    part.uv *= density / own;
    const Place place = put_near(surface.faces, part.uv, part.before, part.uv, context_);
    if (piece.place != Place::kNone) part.place = place;
  }

  const ChartToMend& given_;
  const RepairOptions& options_;
  MendedChart& mended_;
  ExecutionContext& context_;
};

}  // namespace

void judge_stretched(const ChartToMend& given, const RepairOptions& options, MendedChart& mended,
                     ExecutionContext& context) {
  if (options.stretched == StretchedIslands::kIgnore || mended.change == Change::kAnew) return;
  Judgement judge(given, options, mended, context);
  if (options.stretched == StretchedIslands::kImprove) {
    judge.run();
    return;
  }
  const TimeLimit limit(context,
                        seconds_to_search(context.seconds_left(),
                                          static_cast<Index>(given.chart.surface.faces.rows())));
  ended_in_time([&] { judge.run(); });  // it is only a count
}

}  // namespace flipfree::unwrap
