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

// Do boxes share area?
bool meet(const Eigen::AlignedBox2d& a, const Eigen::AlignedBox2d& b) {
  return (a.intersection(b).sizes().array() > 0.0).all();
}

// Mended charts, put where they belong and stored.

// The charts of a result, on their way to where they are stored. By chart:
struct Charts {
  std::vector<mesh::Chart> charts;
  std::vector<std::size_t> source;  // chart of the given map
  std::vector<Points2> uv;          // #V x 2
  std::vector<Points2> before;      // as uv, or empty. What it lay on there, it may lie on
  std::vector<Place> place;
  std::vector<char> remade;        // MendedChart::remade
  std::vector<KeptAsStored> kept;  // does not overlap itself, pinned vertices
  std::vector<char> moved;         // to where there is room
  std::vector<Points2f> stored;
  std::vector<std::size_t> of_face;  // per face of the surface: its chart
};

// The corners of those faces that may meet the box, and an island of that number for each.
Points2 corners_near(const Triangles& faces, const Points2& uv, const Eigen::AlignedBox2d& box,
                     Index island, mesh::Components& islands) {
  Points2 corners = by_corner(faces, uv);
  Eigen::Index kept = 0;
  for (Eigen::Index c = 0; c < corners.rows(); c += 3) {
    if (!box.intersects(bounds_of(corners.middleRows(c, 3)))) continue;
    corners.middleRows(kept, 3) = corners.middleRows(c, 3).eval();
    kept += 3;
    islands.of_face.push_back(island);
  }
  return corners.topRows(kept);
}

bool share_area(const Triangles& faces_a, const Points2& uv_a, const Triangles& faces_b,
                const Points2& uv_b) {
  const Eigen::AlignedBox2d a = bounds_of(uv_a), b = bounds_of(uv_b);
  if (!meet(a, b)) return false;
  mesh::Components two;
  two.count = 2;
  const std::vector<Points2> near{corners_near(faces_a, uv_a, b, 0, two),
                                  corners_near(faces_b, uv_b, a, 1, two)};
  return certify::island_overlaps(two, below_each_other(near)).pairs > 0;
}

constexpr double kSameDensity = 1.1;
constexpr double kMost = 2.0 / 3.0;

// Of the search for a layout of charts none of which has a size of its own (NestOptions).
constexpr double kEffort = 0.2;
// Share of its density below which a layout has no room for charts.
constexpr double kShrunk = 0.999;

// Charts that lie on others, near to their place or with `all` any, are moved: those with pins and
// those at their place stay, then the others, those of most faces first, each unless it shares area
// with one that stays - and `all`, or it did not before, or has no `before`. Throws Cancelled,
// TimeIsOver. Cost: O(n log n) and a comparison of boxes for charts above each other, O(#F) of a
// pair whose boxes meet.
void move_apart(Charts& own, bool all, const ExecutionContext& context) {
  const std::vector<mesh::Chart>& charts = own.charts;
  std::vector<std::size_t> order;
  std::vector<char> may_move;
  std::vector<Eigen::AlignedBox2d> boxes;
  for (std::size_t c = 0; c < charts.size(); ++c) {
    boxes.push_back(bounds_of(own.uv[c]));
    may_move.push_back(own.kept[c].fixed.empty() && (all || own.place[c] == Place::kWhereItWas));
    if (own.moved[c] == 0) order.push_back(c);
  }
  if (std::find(own.place.begin(), own.place.end(), Place::kWhereItWas) == own.place.end()) {
    Items staying;
    for (const std::size_t c : order) staying.push_back({c});
    if (!all || disjoint(charts, staying, own.uv, Points2(0, 2))) return;
  }
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return std::pair(!may_move[a], charts[a].faces.size()) >
           std::pair(!may_move[b], charts[b].faces.size());
  });
  const auto before = [&](std::size_t c) -> const Points2& {
    return own.before[c].rows() > 0 ? own.before[c] : own.uv[c];
  };
  // By size, up to the next power of two, and by left end.
  std::map<int, std::multimap<double, std::size_t>> staying;
  for (const std::size_t c : order) {
    context.check();
    const auto in_the_way = [&](const auto& entry) {
      const std::size_t d = entry.second;
      const Triangles &faces = charts[c].surface.faces, &its = charts[d].surface.faces;
      return meet(boxes[c], boxes[d]) && share_area(faces, own.uv[c], its, own.uv[d]) &&
             (all || own.before[c].rows() == 0 || !share_area(faces, before(c), its, before(d)));
    };
    const auto any_in_the_way = [&](const auto& of_size) {
      const auto& [size, others] = of_size;
      return std::any_of(others.lower_bound(boxes[c].min().x() - std::ldexp(1.0, size)),
                         others.upper_bound(boxes[c].max().x()), in_the_way);
    };
    own.moved[c] = may_move[c] && std::any_of(staying.begin(), staying.end(), any_in_the_way);
    if (own.moved[c] == 0)
      staying[std::ilogb(boxes[c].sizes().maxCoeff()) + 1].emplace(boxes[c].min().x(), c);
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
  std::map<Place, CornerId> at_place;  // of the faces that have a triangle
  std::vector<CornerId> following;
  const auto corners = static_cast<CornerId>(surface.faces.size());
  std::vector<char> held(at(corners), 0);
  for (const certify::CornerPin& pin : pins) held[at(pin.corner)] = 1;
  for (const FaceId f : collapsed) {
    for (CornerId c = 3 * f; c < 3 * f + 3; ++c) {
      if (held[at(c)] != 0 || !is_storable(corner_uv.row(c).transpose())) continue;
      following.push_back(c);
      at_place.try_emplace(place_of(c), kInvalid);
    }
  }
  for (CornerId c = 0; c < corners; ++c) {
    if (!is_storable(corner_uv.row(c).transpose()) ||
        std::binary_search(collapsed.begin(), collapsed.end(), c / 3))
      continue;
    const auto found = at_place.find(place_of(c));
    if (found != at_place.end() && found->second == kInvalid) found->second = c;
  }
  const auto follow = [&](auto& values) {
    using Scalar = typename std::decay_t<decltype(values)>::Scalar;
    for (const CornerId c : following) {
      const CornerId leader = at_place.at(place_of(c));
      if (leader == kInvalid) {
        values.row(c) = corner_uv.row(c).template cast<Scalar>();
      } else {
        values.row(c) = values.row(leader);
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
        seen_(on_texture(given_, options.aspect)),
        density_(common_density(given_.charts, seen_.places)),
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
      for (const std::size_t c : unstorable) want_anew(c, wanted);
      if (any_flag(wanted)) continue;
      if (!unstorable.empty()) throw_unstorable(made_.charts[unstorable.front()].faces.front());
      certify::Parametrization map = finished();
      for (const FaceId f : map.certificate.failed_faces) want_anew(made_.of_face[at(f)], wanted);
      if (map.certificate.ok || !any_flag(wanted)) {
        certify::require_certificate(map, "The repaired map");
        return map;
      }
    }
  }

  // c: a chart of the result. That of the given map which it comes from is made anew, once.
  void want_anew(std::size_t c, std::vector<char>& wanted) {
    const std::size_t given = made_.source[c];
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
      const ChartToMend chart{given,
                              given_.vertex_origin,
                              seen_.places[c],
                              given_.unknown[c],
                              seen_.pins[c],
                              part_of(given, seams_),
                              part_of(given, uncuttable_),
                              density_};
      mended_[c] = mend_chart(chart, options_, anew_[c] != 0, context);
      judge_stretched(chart, options_, mended_[c], context);
    };
    for_each_chart(given_.charts, largest_first(given_.charts, wanted), "mending charts", context_,
                   mend_one);
  }

  // The charts of the result, from the mended ones and their further cuts.
  void collect() {
    made_ = {};
    cuts_ = given_.cuts;
    sized_ = true;
    std::vector<std::size_t> source(at(surface_.faces.rows()));
    std::vector<Place> place(source.size());
    std::vector<char> remade(source.size());
    Points2 uv(surface_.faces.size(), 2);
    Points2 before(uv.rows(), 2);  // that stretched islands were made better
    for (std::size_t c = 0; c < mended_.size(); ++c) {
      const mesh::Chart& chart = given_.charts[c];
      const MendedChart& mended = mended_[c];
      sized_ = sized_ && mended.has_density;
      const auto stored_places = [&](const Points2& own, Points2& corners) {
        for (std::size_t h = 0; h < at(own.rows()); ++h) {
          corners.row(static_cast<Eigen::Index>(corner_of(chart, h))) =
              certify::row_from_texture(own.row(static_cast<Eigen::Index>(h)), options_.aspect,
                                        given_.places[c].row(chart.surface.faces.data()[h]));
        }
      };
      stored_places(mended.uv, uv);
      stored_places(mended.before, before);
      for (std::size_t h = 0; h < mended.cut.size(); ++h)
        cuts_[corner_of(chart, h)] |= mended.cut[h];
      for (std::size_t f = 0; f < chart.faces.size(); ++f) {
        place[at(chart.faces[f])] = mended.place[f];
        remade[at(chart.faces[f])] = mended.remade[f];
        source[at(chart.faces[f])] = c;
      }
    }
    made_.charts = mesh::split_into_charts(surface_.vertices,
                                           mesh::cut_along(surface_.faces, adjacency_, cuts_));
    made_.of_face.resize(source.size());
    made_.kept.resize(made_.charts.size());
    for (std::size_t c = 0; c < made_.charts.size(); ++c) {
      const mesh::Chart& chart = made_.charts[c];
      const std::size_t first = at(chart.faces.front());
      made_.source.push_back(source[first]);
      made_.place.push_back(place[first]);
      made_.remade.push_back(remade[first]);
      made_.uv.push_back(by_vertex(chart, uv));
      made_.before.push_back(mended_[source[first]].before.rows() > 0 ? by_vertex(chart, before)
                                                                      : Points2(0, 2));
      for (const FaceId f : chart.faces) made_.of_face[at(f)] = c;
    }
    for (const certify::CornerPin& pin : options_.pins) {
      const std::size_t c = made_.of_face[at(pin.corner / 3)];
      const mesh::Chart& chart = made_.charts[c];
      const auto f = std::lower_bound(chart.faces.begin(), chart.faces.end(), pin.corner / 3) -
                     chart.faces.begin();
      made_.kept[c].fixed.push_back(chart.surface.faces(f, pin.corner % 3));
    }
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
  // (median_density()) that two thirds by area of those that are not, or of all if there are no
  // others, have within a tenth.
  void take_one_scale() {
    const bool all = std::find(made_.remade.begin(), made_.remade.end(), 0) == made_.remade.end();
    std::vector<double> densities;
    std::vector<std::pair<double, double>> standing;  // density, area
    double total = 0.0;
    for (std::size_t c = 0; c < made_.charts.size(); ++c) {
      const mesh::Surface& chart = made_.charts[c].surface;
      densities.push_back(median_density(chart, certify::on_texture(made_.uv[c], options_.aspect)));
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
  const SeenMap seen_;
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
