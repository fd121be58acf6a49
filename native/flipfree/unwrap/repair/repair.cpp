#include "flipfree/unwrap/repair/repair.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>
#include <tuple>
#include <type_traits>
#include <utility>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/base/error.h"
#include "flipfree/base/failure.h"
#include "flipfree/base/parallel.h"
#include "flipfree/base/plane.h"
#include "flipfree/base/types.h"
#include "flipfree/certify/certified_map.h"
#include "flipfree/certify/measures.h"
#include "flipfree/certify/overlap.h"
#include "flipfree/certify/separated_map.h"
#include "flipfree/certify/texture.h"
#include "flipfree/distortion/energy/energy.h"
#include "flipfree/distortion/minimize/boundary_barrier.h"
#include "flipfree/distortion/rounding.h"
#include "flipfree/distortion/valid_map.h"
#include "flipfree/mesh/cut.h"
#include "flipfree/mesh/face_area.h"
#include "flipfree/mesh/surface.h"
#include "flipfree/unwrap/islands/islands.h"
#include "flipfree/unwrap/packing/layout.h"
#include "flipfree/unwrap/packing/place.h"
#include "flipfree/unwrap/packing/rectangles.h"
#include "flipfree/unwrap/repair/given_map.h"
#include "flipfree/unwrap/repair/mend_chart.h"
#include "flipfree/unwrap/repair/patches.h"
#include "flipfree/unwrap/unwrap.h"

namespace flipfree::unwrap {

namespace {

// Mended charts, put where they belong and stored.

// The charts of a result, on their way to where they are stored. By chart:
struct Charts {
  std::vector<mesh::Chart> charts;
  std::vector<std::size_t> source;  // chart of the given map
  std::vector<Points2> uv;          // #V x 2
  std::vector<Points2> before;      // as uv, or empty. What it lay on there, it may lie on
  std::vector<Place> place;
  std::vector<char> remade;        // Piece::remade
  std::vector<KeptAsStored> kept;  // does not overlap itself, pinned vertices
  std::vector<char> moved;         // to where there is room
  std::vector<Points2f> stored;
};

constexpr double kSameDensity = 1.1;
constexpr double kMost = 2.0 / 3.0;

// Of the search for a layout of charts none of which has a size of its own (NestOptions).
constexpr double kEffort = 0.2;
// Share of its density below which a layout has no room for charts.
constexpr double kShrunk = 0.999;

// Charts that lie on others, near to their place or with `all` any, are moved: those with pins and
// those at their place stay, then the others, those of most faces first, each unless it shares area
// with one that stays - and `all`, or it did not before, or has no `before`. Throws Cancelled,
// TimeIsOver. Cost: O(#F log #F) and a comparison of boxes for charts above each other, a search in
// the trees of a pair whose boxes meet.
void move_apart(Charts& own, bool all, const ExecutionContext& context) {
  const std::vector<mesh::Chart>& charts = own.charts;
  std::vector<std::size_t> order;
  std::vector<char> may_move;
  mesh::Components islands{static_cast<Index>(charts.size()), {}};
  std::vector<Points2> now, before;
  for (std::size_t c = 0; c < charts.size(); ++c) {
    may_move.push_back(own.kept[c].fixed.empty() && (all || own.place[c] == Place::kWhereItWas));
    if (own.moved[c] == 0) order.push_back(c);
  }
  if (!any_flag(may_move)) return;
  for (std::size_t c = 0; c < charts.size(); ++c) {
    const Triangles& faces = charts[c].surface.faces;
    islands.of_face.insert(islands.of_face.end(), charts[c].faces.size(), static_cast<Index>(c));
    now.push_back(by_corner(faces, own.uv[c]));
    before.push_back(own.before[c].rows() > 0 ? by_corner(faces, own.before[c]) : now.back());
  }
  const Points2 corners = below_each_other(now), corners_before = below_each_other(before);
  const auto meet = certify::sharing_area(islands, corners);
  const auto met = certify::sharing_area(islands, corners_before);
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return std::pair(!may_move[a], charts[a].faces.size()) >
           std::pair(!may_move[b], charts[b].faces.size());
  });
  // By size, up to the next power of two, and by left end.
  std::map<int, std::multimap<double, std::size_t>> staying;
  for (const std::size_t c : order) {
    context.check();
    const Eigen::AlignedBox2d box = bounds_of(own.uv[c]);
    const auto in_the_way = [&](const auto& entry) {
      const std::size_t d = entry.second;
      return meet(c, d) && (all || own.before[c].rows() == 0 || !met(c, d));
    };
    const auto any_in_the_way = [&](const auto& of_size) {
      const auto& [size, others] = of_size;
      return std::any_of(others.lower_bound(box.min().x() - std::ldexp(1.0, size)),
                         others.upper_bound(box.max().x()), in_the_way);
    };
    own.moved[c] = may_move[c] && std::any_of(staying.begin(), staying.end(), any_in_the_way);
    if (own.moved[c] == 0)
      staying[std::ilogb(box.sizes().maxCoeff()) + 1].emplace(box.min().x(), c);
  }
}

// Charts that move, to the right of all that stays and of the unit square, as they are.
void put_beside(const std::vector<char>& moved, double margin, std::vector<Points2>& uv) {
  double right = 1.0;
  std::vector<std::size_t> chosen;
  std::vector<Vector2> sizes;
  for (std::size_t c = 0; c < uv.size(); ++c) {
    const Eigen::AlignedBox2d box = bounds_of(uv[c]);
    if (moved[c] == 0) {
      right = std::max(right, box.max().x());
      continue;
    }
    chosen.push_back(c);
    sizes.emplace_back(box.sizes() + Vector2::Constant(margin));
  }
  RoomOptions room;
  room.margin = 0.0;
  const Placement placement = pack_rectangles(sizes, room);
  const Eigen::RowVector2d left(std::ceil(right) + margin, margin);
  for (std::size_t i = 0; i < chosen.size(); ++i) {
    Points2& own = uv[chosen[i]];
    own.rowwise() +=
        left + placement.corner[i].transpose() / placement.scale - own.colwise().minCoeff();
  }
}

// Charts without a place, those near to it that lie on others, and with options.disjoint all that
// lie on larger ones, are packed where the unit square has room for them, or put to the right of
// it and of the map; the others stay. sized: the charts' sizes mean something, and are kept; else
// those that move get the largest common scale. Returns the charts that 32 bits do not hold; if
// there are any, nothing else counts. Throws what place_charts() throws.
std::vector<std::size_t> settle(Charts& own, bool sized, const RepairOptions& options,
                                ExecutionContext& context) {
  for (const Place place : own.place) own.moved.push_back(place == Place::kNone);
  move_apart(own, options.disjoint, context);
  Unstorable unstorable;
  const auto store = [&](const std::vector<Points2>& uv) {
    StoredCharts stored = store_charts(own.charts, uv, own.kept, context);
    unstorable = std::move(stored.unstorable);
    if (!unstorable.empty()) throw NotConverged(unstorable.front().second);
    return std::move(stored.uv);
  };
  try {
    if (any_flag(own.moved)) {
      PlacingOptions placing;
      placing.margin = options.margin;
      placing.effort = sized ? 0.0 : kEffort;
      // On a texture that is no square they would be bent by turning.
      const bool stays_upright = sized || options.aspect != 1.0;
      placing.rotation = stays_upright ? Rotation::kNone : Rotation::kStraight;
      placing.scale_true = !sized;
      const double density = areas_of(own.charts, own.uv, own.moved).density();
      if (sized) placing.density = density;
      try {
        PlacedCharts placed =
            place_charts(own.charts, own.uv, own.moved, placing, {}, Points2(0, 2), store, context);
        if (!sized || areas_of(own.charts, placed.uv, own.moved).density() >= kShrunk * density) {
          own.uv = std::move(placed.uv);
          own.stored = std::move(placed.stored);
          return {};
        }
      } catch (const InvalidInput& e) {
        if (e.error().code != ErrorCode::kBadOption) throw;  // all tiles are full
      }
      // Where the square has no room for their size, they keep that.
      put_beside(own.moved, options.margin, own.uv);
    }
    own.stored = store(own.uv);
  } catch (const NotConverged&) {
    if (unstorable.empty()) throw;
  }
  std::vector<std::size_t> charts;
  for (const auto& [c, error] : unstorable) charts.push_back(c);
  return charts;
}

// Corners of faces that use a vertex twice, which no chart has: where another corner at their
// vertex was at the same place they go on to be where that is, else they stay. But for pinned ones.
void follow_neighbours(const std::vector<FaceId>& collapsed, const mesh::Surface& surface,
                       const Points2& corner_uv, const std::vector<certify::CornerPin>& pins,
                       certify::Parametrization& map) {
  if (collapsed.empty()) return;
  using Place = std::tuple<VertexId, double, double>;
  const auto place_of = [&](CornerId c) {
    return Place{surface.faces.data()[c], corner_uv(c, 0), corner_uv(c, 1)};
  };
  std::vector<char> held(at(static_cast<Index>(surface.faces.size())), 0);
  for (const certify::CornerPin& pin : pins) held[at(pin.corner)] = 1;
  std::vector<char> followed(at(surface.vertices.rows()), 0);
  for (const FaceId f : collapsed)
    for (const VertexId v : surface.faces.row(f)) followed[at(v)] = 1;
  std::map<Place, CornerId> leaders;  // of the faces that have a triangle
  const auto has_place = [&](CornerId c) { return is_storable(corner_uv.row(c).transpose()); };
  for (CornerId c = 0; c < static_cast<CornerId>(surface.faces.size()); ++c) {
    if (followed[at(surface.faces.data()[c])] != 0 && has_place(c) &&
        !std::binary_search(collapsed.begin(), collapsed.end(), c / 3))
      leaders.try_emplace(place_of(c), c);
  }
  const auto follow = [&](auto& values) {
    using Scalar = typename std::decay_t<decltype(values)>::Scalar;
    for (const FaceId f : collapsed) {
      for (CornerId c = 3 * f; c < 3 * f + 3; ++c) {
        if (held[at(c)] != 0 || !has_place(c)) continue;
        const auto leader = leaders.find(place_of(c));
        values.row(c) = leader == leaders.end() ? corner_uv.row(c).template cast<Scalar>().eval()
                                                : values.row(leader->second).eval();
      }
    }
  };
  follow(map.uv);
  follow(map.uv32);
  if (map.agreed.rows() > 0) follow(map.agreed);
}

certify::CertifyRequest request_of(const RepairOptions& options) {
  certify::CertifyRequest request;
  request.pins = options.pins;
  request.require_bijective = options.overlaps != SelfOverlaps::kKeep;
  request.require_disjoint = options.disjoint && options.pins.empty();
  request.aspect = options.aspect;
  return request;
}

class Repair {
 public:
  Repair(const mesh::Surface& surface, const Points2& corner_uv, const RepairOptions& options,
         ExecutionContext& context)
      : surface_(surface),
        options_(options),
        context_(context),
        adjacency_(surface.adjacency()),
        seams_(mesh::flag_edges(surface.faces, adjacency_, options.cuts)),
        uncuttable_(flags_of(surface, options.uncuttable)),
        given_(read_map(surface, corner_uv, seams_, options.pins)),
        seen_(on_texture(given_.places, options.aspect)),
        density_(common_density(given_.charts, seen_)),
        mended_(given_.charts.size()),
        anew_(given_.charts.size(), 0) {
    measure_before(surface, given_, corner_uv, options.aspect, stats_, context);
    corner_uv_ = &corner_uv;
  }

  // Charts whose stored map does not hold are made anew, and again settled with the others; where
  // that does not hold either, all of them.
  certify::Parametrization run() {
    try {
      return mended_map();
    } catch (const NotConverged&) {
      if (!options_.pins.empty()) throw;
    }
    return all_anew();
  }

 private:
  // Of the given map only its cuts count. An unwrap cuts further around what cannot be stored.
  certify::Parametrization all_anew() {
    UnwrapOptions unwrapping;
    unwrapping.cuts = mesh::flagged_edges(surface_.faces, adjacency_, given_.cuts);
    unwrapping.uncuttable = options_.uncuttable;
    unwrapping.bijective = options_.overlaps != SelfOverlaps::kKeep;
    unwrapping.may_add_cuts = options_.overlaps != SelfOverlaps::kOpen;
    unwrapping.margin = options_.margin;
    unwrapping.max_iterations = options_.max_iterations;
    unwrapping.tolerance = options_.tolerance;
    certify::Parametrization map = unwrap(surface_, unwrapping, context_);
    const StatValue added = map.stats["added_cuts"];
    if (options_.aspect != 1.0) {
      // Narrower, or lower, in the unit square; stored and judged as any given map.
      map.uv.col(0) /= options_.aspect;
      map.uv *= std::min(options_.aspect, 1.0);
      map = Repair(surface_, Points2(map.uv), options_, context_).mended_map();
    }
    Stats stats = stats_;  // of the map before
    for (const char* name : {"charts", "energy", "max_energy"}) stats[name] = map.stats[name];
    for (const char* name : {"charts_anew", "charts_moved"}) stats[name] = stats["charts"];
    for (const char* name :
         {"charts_mirrored", "charts_unfolded", "charts_cut", "charts_improved",
          "charts_stretched_anew", "stretched_charts", "corners_kept", "added_vertices"})
      stats[name] = std::int64_t{0};
    stats["added_cuts"] = added;
    map.stats = std::move(stats);
    return map;
  }

  certify::Parametrization mended_map() {
    std::vector<char> wanted(given_.charts.size(), 1);
    while (true) {
      {
        const ProgressRange range(context_, 0.05, 0.85);
        mend(wanted);
      }
      context_.report("placing charts", 0.86);
      collect();
      const ProgressRange range(context_, 0.86, 0.95);
      const std::vector<std::size_t> unstorable = settle(made_, sized_, options_, context_);
      wanted.assign(wanted.size(), 0);
      for (const std::size_t c : unstorable) want_anew(made_.source[c], wanted);
      if (any_flag(wanted)) continue;
      if (!unstorable.empty()) throw_unstorable(made_.charts[unstorable.front()].faces.front());
      certify::Parametrization map = finished();
      for (const FaceId f : map.certificate.failed_faces) {
        const auto holds_face = [&](const mesh::Chart& chart) {
          return std::binary_search(chart.faces.begin(), chart.faces.end(), f);
        };
        const auto& charts = given_.charts;
        want_anew(at(std::find_if(charts.begin(), charts.end(), holds_face) - charts.begin()),
                  wanted);
      }
      if (map.certificate.ok || !any_flag(wanted)) {
        certify::require_certificate(map, "The repaired map");
        return map;
      }
    }
  }

  // A chart of the given map is made anew once.
  void want_anew(std::size_t given, std::vector<char>& wanted) {
    if (anew_[given] != 0 || mended_[given].change == Change::kAnew) return;
    wanted[given] = anew_[given] = 1;
  }

  [[noreturn]] static void throw_unstorable(FaceId first) {
    throw_not_converged(ErrorCode::kRoundingFlips,
                        "The chart of face " + face_id(first) +
                            " has triangles too small for the 32 bits that are stored. Enlarge it, "
                            "or mark seams that cut its long and thin parts off.",
                        ElementKind::kFace, {first});
  }

  void mend(const std::vector<char>& wanted) {
    const auto mend_one = [&](std::size_t c, ExecutionContext& context) {
      const mesh::Chart& given = given_.charts[c];
      const VertexPins pins = on_texture(given_.pins[c], options_.aspect);
      const ChartToMend chart{given,
                              given_.vertex_origin,
                              seen_[c],
                              given_.unknown[c],
                              pins,
                              part_of(given, seams_),
                              part_of(given, uncuttable_),
                              density_};
      mended_[c] = mend_chart(chart, options_, anew_[c] != 0, context);
      judge_stretched(chart, options_, mended_[c], context);
    };
    for_each_chart(given_.charts, largest_first(given_.charts, wanted), "mending charts", context_,
                   mend_one);
  }

  // The charts of the result, by their smallest face: the pieces of the mended ones.
  void collect() {
    made_ = {};
    cuts_ = given_.cuts;
    sized_ = true;
    std::map<FaceId, std::pair<std::size_t, const Piece*>> pieces;
    for (std::size_t c = 0; c < mended_.size(); ++c) {
      const mesh::Chart& chart = given_.charts[c];
      sized_ = sized_ && mended_[c].has_density;
      for (std::size_t h = 0; h < mended_[c].cut.size(); ++h)
        cuts_[corner_of(chart, h)] |= mended_[c].cut[h];
      for (const Piece& piece : mended_[c].pieces)
        pieces[chart.faces[at(piece.chart.faces.front())]] = {c, &piece};
    }
    for (const auto& [first, from] : pieces) {
      const auto& [c, piece] = from;
      const auto stored_places = [&, c = c, piece = piece](const Points2& uv) {
        return certify::from_texture(uv, options_.aspect,
                                     given_.places[c](piece->chart.vertices, Eigen::all));
      };
      mesh::Chart& chart = made_.charts.emplace_back(piece->chart);
      for (FaceId& f : chart.faces) f = given_.charts[c].faces[at(f)];
      made_.source.push_back(c);
      made_.place.push_back(piece->place);
      made_.remade.push_back(piece->remade);
      made_.uv.push_back(stored_places(piece->uv));
      made_.before.push_back(stored_places(piece->before));
    }
    made_.kept.resize(made_.charts.size());
    const ChartPins pins =
        pins_of_charts(made_.charts, options_.pins, static_cast<Index>(surface_.faces.size()));
    for (std::size_t c = 0; c < pins.size(); ++c)
      for (const auto& [v, place] : pins[c]) made_.kept[c].fixed.push_back(v);
    if (options_.stretched == StretchedIslands::kImprove && sized_) take_one_scale();
    parallel_for(context_, made_.charts.size(), 16,
                 [&](std::size_t begin, std::size_t end, std::size_t) {
                   const ExecutionContext part(&context_, 1);
                   for (std::size_t c = begin; c < end; ++c)
                     made_.kept[c].bijective =
                         !overlaps_itself(made_.charts[c].surface.faces, made_.uv[c], part);
                 });
  }

  // Where most of what stands has one scale: charts that are remade take the density
  // (density_of()) that two thirds by area of those that are not, or of all if there are no
  // others, have within a tenth.
  void take_one_scale() {
    const bool all = std::find(made_.remade.begin(), made_.remade.end(), 0) == made_.remade.end();
    std::vector<double> densities;
    std::vector<std::pair<double, double>> standing;  // density, area
    double total = 0.0;
    for (std::size_t c = 0; c < made_.charts.size(); ++c) {
      const mesh::Surface& chart = made_.charts[c].surface;
      densities.push_back(
          density_of(chart, certify::on_texture(made_.uv[c], options_.aspect)).value);
      if ((made_.remade[c] != 0 && !all) || !(densities[c] > 0.0)) continue;
      standing.emplace_back(densities[c], mesh::area_of(chart));
      total += standing.back().second;
    }
    const double median = weighted_percentile(standing);
    double same = 0.0;
    for (const auto& [density, area] : standing) {
      if (density <= kSameDensity * median && median <= kSameDensity * density) same += area;
    }
    if (same < kMost * total) return;
    for (std::size_t c = 0; c < made_.charts.size(); ++c) {
      const double factor = median / densities[c];
      if (made_.remade[c] == 0 || !std::isnormal(factor) || factor == 1.0) continue;
      const Points2& uv = made_.uv[c];
      const Eigen::RowVector2d middle = uv.colwise().mean();
      Points2 other = (factor * (uv.rowwise() - middle)).rowwise() + middle;
      if (distortion::is_flip_free(made_.charts[c].surface.faces, other, context_))
        made_.uv[c] = std::move(other);
    }
  }

  certify::Parametrization finished() {
    const Grace finishing(context_);
    context_.report("certifying", 0.95);
    certify::Parametrization map =
        map_of_charts(surface_, mesh::flagged_edges(surface_.faces, adjacency_, cuts_),
                      made_.charts, made_.uv, made_.stored);
    map.stats = stats_;
    certify::certify_map(map, surface_, request_of(options_), context_);
    count(map);
    return map;
  }

  void count(certify::Parametrization& map) const {
    Stats& stats = map.stats;
    for (const char* name : {"charts_mirrored", "charts_unfolded", "charts_anew", "charts_cut",
                             "charts_improved", "charts_stretched_anew", "stretched_charts"})
      stats[name] = std::int64_t{0};
    const auto add = [&](const char* name, std::int64_t more) {
      std::get<std::int64_t>(stats[name]) += more;
    };
    for (const MendedChart& chart : mended_) {
      add("charts_mirrored", chart.change == Change::kMirrored);
      add("charts_unfolded", chart.change == Change::kUnfolded);
      add("charts_anew", chart.change == Change::kAnew);
      add("charts_cut", chart.was_cut);
      add("charts_improved", chart.stretched.improved);
      add("charts_stretched_anew", chart.stretched.anew);
      add("stretched_charts", chart.stretched.left);
    }
    stats["charts"] = static_cast<std::int64_t>(made_.charts.size());
    stats["charts_moved"] =
        static_cast<std::int64_t>(std::count(made_.moved.begin(), made_.moved.end(), 1));
    stats["added_cuts"] =
        static_cast<std::int64_t>(std::count(cuts_.begin(), cuts_.end(), 1) -
                                  std::count(given_.cuts.begin(), given_.cuts.end(), 1)) /
        2;
    std::int64_t kept = 0;
    for (Eigen::Index c = 0; c < map.uv.rows(); ++c) kept += map.uv.row(c) == corner_uv_->row(c);
    stats["corners_kept"] = kept;
    stats["energy"] = map.certificate.energy;
    stats["max_energy"] = map.certificate.max_energy;
    stats["added_vertices"] = std::int64_t{0};
  }

  const mesh::Surface& surface_;
  const RepairOptions& options_;
  ExecutionContext& context_;
  const mesh::Adjacency& adjacency_;
  const mesh::EdgeFlags seams_;
  const mesh::EdgeFlags uncuttable_;
  const GivenMap given_;
  const std::vector<Points2> seen_;  // its charts' places as the texture shows them
  const double density_;
  const Points2* corner_uv_ = nullptr;
  Stats stats_;
  std::vector<MendedChart> mended_;
  std::vector<char> anew_;  // per given chart: it was not storable otherwise
  // The result.
  mesh::EdgeFlags cuts_;
  Charts made_;
  bool sized_ = true;
};

// A mesh that is no clean surface: by way of one (mesh/separated), with corner_uv as its map.
certify::Parametrization repair_separated(const mesh::Surface& surface, const Points2& corner_uv,
                                          const RepairOptions& options, ExecutionContext& context) {
  // Values that are none join nothing and turn nothing over.
  Points2 finite = corner_uv;
  for (Eigen::Index c = 0; c < finite.rows(); ++c) {
    if (!is_storable(finite.row(c).transpose())) finite.row(c).setZero();
  }
  mesh::SeparateOptions separating;
  separating.corner_uv = &finite;
  separating.diagonals = &options.uncuttable;
  const certify::SeparatedMap separated(surface, separating, context);
  RepairOptions own = options;
  own.cuts = separated.edges(options.cuts);
  own.uncuttable = separated.edges(options.uncuttable);
  own.pins = separated.pins(options.pins);
  const Points2 own_uv = separated.corners(corner_uv);
  const certify::Parametrization solved =
      separated.solve([&] { return Repair(separated.surface(), own_uv, own, context).run(); });
  certify::CertifyRequest request = request_of(options);
  request.require_bijective = request.require_disjoint = false;  // judged once all corners follow
  certify::Parametrization map = separated.on_input(solved, request, context);
  follow_neighbours(separated.separated().collapsed, surface, corner_uv, options.pins, map);
  const Grace judging(context);
  request = request_of(options);
  request.surface = &surface;
  request.uv = &map.uv;
  request.uv32 = &map.uv32;
  map.certificate = certify::certify_any(request, context);
  map.stats["corners_kept"] = (map.uv.array() == corner_uv.array()).rowwise().all().count();
  map.stats["energy"] = map.certificate.energy;
  map.stats["max_energy"] = map.certificate.max_energy;
  certify::require_certificate(map, "The repaired map");
  return map;
}

}  // namespace

certify::Parametrization repair(const mesh::Surface& surface, const Points2& corner_uv,
                                const RepairOptions& options, ExecutionContext& context) {
  return in_time(context, options.max_seconds, "Not all islands were mended",
                 "or repair the mesh in parts", [&] {
                   const Stopwatch watch;
                   context.report("checking the map", 0.0);
                   distortion::require_corner_uv(surface, corner_uv);
                   certify::Parametrization map =
                       certify::is_clean(surface, context)
                           ? Repair(surface, corner_uv, options, context).run()
                           : repair_separated(surface, corner_uv, options, context);
                   map.stats["seconds"] = watch.seconds();
                   const Grace finishing(context);
                   context.report("done", 1.0);
                   return map;
                 });
}

}  // namespace flipfree::unwrap
