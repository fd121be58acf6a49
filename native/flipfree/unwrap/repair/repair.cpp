#include "flipfree/unwrap/repair/repair.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <numeric>
#include <optional>
#include <set>
#include <string>
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

// Do boxes share area?
bool meet(const Eigen::AlignedBox2d& a, const Eigen::AlignedBox2d& b) {
  return (a.intersection(b).sizes().array() > 0.0).all();
}

// Mended charts, put where they belong and stored.

struct ChartToSettle {
  Points2 uv;  // #V x 2
  Place place = Place::kStays;
  KeptAsStored kept;  // does not overlap itself, pinned vertices
  Points2 before;     // #V x 2, or empty: as `uv`. What it lay on there, it may lie on.
};

struct SettledCharts {
  std::vector<Points2> uv;
  std::vector<Points2f> stored;
  std::vector<char> moved;
  std::vector<std::size_t> unstorable;  // charts that 32 bits do not hold; then nothing else counts
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

// The density (median_density()) that two thirds by area of the charts that are not remade, or of
// all if there are no others, have within a tenth; 0 if they have none in common.
double common(const std::vector<mesh::Chart>& charts, const std::vector<double>& densities,
              const std::vector<char>& remade) {
  const bool all = std::find(remade.begin(), remade.end(), 0) == remade.end();
  std::vector<std::pair<double, double>> standing;  // and area
  double total = 0.0;
  for (std::size_t c = 0; c < charts.size(); ++c) {
    if ((remade[c] != 0 && !all) || !(densities[c] > 0.0)) continue;
    standing.emplace_back(densities[c], mesh::area_of(charts[c].surface));
    total += standing.back().second;
  }
  const double median = weighted_percentile(standing);
  double same = 0.0;
  for (const auto& [density, area] : standing) {
    if (density <= kSameDensity * median && median <= kSameDensity * density) same += area;
  }
  return same >= kMost * total ? median : 0.0;
}

// Of the search for a layout of charts none of which has a size of its own (NestOptions).
constexpr double kEffort = 0.2;
// Share of its density below which a layout has no room for charts.
constexpr double kShrunk = 0.999;

// Charts that lie on others, near to their place or with `all` any, are moved: those with pins and
// those at their place stay, then the others, those of most faces first, each unless it shares area
// with one that stays - and `all`, or it did not before, or has no `before`. Throws Cancelled,
// TimeIsOver. Cost: O(n log n) and a comparison of boxes for charts above each other, O(#F) of a
// pair whose boxes meet.
void move_apart(const std::vector<mesh::Chart>& charts, const std::vector<ChartToSettle>& mended,
                bool all, std::vector<char>& moved, const ExecutionContext& context) {
  const auto near_its_place = [](const ChartToSettle& chart) {
    return chart.place == Place::kWhereItWas;
  };
  std::vector<std::size_t> order;
  std::vector<char> may_move(charts.size());
  std::vector<Eigen::AlignedBox2d> boxes;
  for (std::size_t c = 0; c < charts.size(); ++c) {
    boxes.push_back(bounds_of(mended[c].uv));
    may_move[c] = mended[c].kept.fixed.empty() && (all || near_its_place(mended[c]));
    if (moved[c] == 0) order.push_back(c);
  }
  if (std::none_of(mended.begin(), mended.end(), near_its_place)) {
    Items staying;
    std::vector<Points2> uv;
    for (const ChartToSettle& chart : mended) uv.push_back(chart.uv);
    for (const std::size_t c : order) staying.push_back({c});
    if (!all || disjoint(charts, staying, uv, Points2(0, 2))) return;
  }
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return std::pair(!may_move[a], charts[a].faces.size()) >
           std::pair(!may_move[b], charts[b].faces.size());
  });
  const auto before = [&](std::size_t c) -> const Points2& {
    return mended[c].before.rows() > 0 ? mended[c].before : mended[c].uv;
  };
  // By size, up to the next power of two, and by left end.
  std::map<int, std::multimap<double, std::size_t>> staying;
  for (const std::size_t c : order) {
    context.check();
    const auto in_the_way = [&](const auto& entry) {
      const std::size_t d = entry.second;
      const Triangles &own = charts[c].surface.faces, &its = charts[d].surface.faces;
      return meet(boxes[c], boxes[d]) && share_area(own, mended[c].uv, its, mended[d].uv) &&
             (all || mended[c].before.rows() == 0 || !share_area(own, before(c), its, before(d)));
    };
    const auto any_in_the_way = [&](const auto& of_size) {
      const auto& [size, others] = of_size;
      return std::any_of(others.lower_bound(boxes[c].min().x() - std::ldexp(1.0, size)),
                         others.upper_bound(boxes[c].max().x()), in_the_way);
    };
    moved[c] = may_move[c] && std::any_of(staying.begin(), staying.end(), any_in_the_way);
    if (moved[c] == 0)
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

// Nothing where all tiles are full.
template <typename Place>
std::optional<PlacedCharts> attempt_placing(Place place) {
  try {
    return place();
  } catch (const InvalidInput& e) {
    if (e.error().code != ErrorCode::kBadOption) throw;
    return std::nullopt;
  }
}

// Charts without a place, those near to it that lie on others, and with options.disjoint all that
// lie on larger ones, are packed where the unit square has room for them, or put to the right of
// it and of the map; the others stay. sized: the charts' sizes mean something, and are kept; else
// those that move get the largest common scale. Throws what place_charts() throws.
SettledCharts settle(const std::vector<mesh::Chart>& charts, std::vector<ChartToSettle> mended,
                     bool sized, const RepairOptions& options, ExecutionContext& context) {
  SettledCharts settled;
  settled.moved.resize(charts.size());
  for (std::size_t c = 0; c < charts.size(); ++c)
    settled.moved[c] = mended[c].place == Place::kNone;
  move_apart(charts, mended, options.disjoint, settled.moved, context);
  std::vector<KeptAsStored> kept;
  for (ChartToSettle& chart : mended) {
    settled.uv.push_back(std::move(chart.uv));
    kept.push_back(std::move(chart.kept));
  }
  Unstorable unstorable;
  const auto store = [&](const std::vector<Points2>& uv) {
    std::int64_t repaired = 0;
    std::vector<Points2f> stored = store_charts(charts, uv, kept, unstorable, repaired, context);
    if (!unstorable.empty()) throw NotConverged(unstorable.front().second);
    return stored;
  };
  try {
    if (std::find(settled.moved.begin(), settled.moved.end(), 1) == settled.moved.end()) {
      settled.stored = store(settled.uv);
      return settled;
    }
    PlacingOptions placing;
    placing.margin = options.margin;
    placing.effort = sized ? 0.0 : kEffort;
    // On a texture that is no square they would be bent by turning.
    const bool stays_upright = sized || options.aspect != 1.0;
    placing.rotation = stays_upright ? Rotation::kNone : Rotation::kStraight;
    placing.scale_true = !sized;
    const double density = areas_of(charts, settled.uv, settled.moved).density();
    if (sized) placing.density = density;
    const std::optional<PlacedCharts> placed = attempt_placing([&] {
      return place_charts(charts, settled.uv, settled.moved, placing, {}, Points2(0, 2), store,
                          context);
    });
    // Where the square has no room for their size, they keep that.
    if (!placed ||
        (sized && areas_of(charts, placed->uv, settled.moved).density() < kShrunk * density)) {
      put_beside(settled.moved, options.margin, settled.uv);
      settled.stored = store(settled.uv);
      return settled;
    }
    settled.uv = placed->uv;
    settled.stored = placed->stored;
  } catch (const NotConverged&) {
    if (unstorable.empty()) throw;
    for (const auto& [c, error] : unstorable) settled.unstorable.push_back(c);
  }
  return settled;
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

class Repair {
 public:
  Repair(const mesh::Surface& surface, const Points2& corner_uv, const RepairOptions& options,
         ExecutionContext& context)
      : surface_(surface),
        options_(options),
        context_(context),
        adjacency_(surface.adjacency()),
        seams_(mesh::flag_edges(surface.faces, adjacency_, options.cuts)),
        uncuttable_(options.uncuttable.rows() == 0
                        ? mesh::EdgeFlags{}
                        : mesh::flag_edges(surface.faces, adjacency_, options.uncuttable)),
        given_(read_map(surface, adjacency_, corner_uv, seams_, options.pins)),
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
    std::erase_if(map.stats, [](const auto& entry) {
      return !std::set<std::string>{"charts", "added_cuts", "energy", "max_energy"}.contains(
          entry.first);
    });
    map.stats.insert(stats_.begin(), stats_.end());  // of the map before
    const auto charts = std::get<std::int64_t>(map.stats["charts"]);
    for (const char* name : {"charts_anew", "charts_moved"}) map.stats[name] = charts;
    for (const char* name : {"charts_mirrored", "charts_unfolded", "charts_cut", "charts_improved",
                             "charts_stretched_anew", "stretched_charts", "corners_kept"})
      map.stats[name] = std::int64_t{0};
    map.stats["added_vertices"] = std::int64_t{0};
    map.stats["added_cuts"] = added;
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
      settled_ = settle(charts_, to_settle_, sized_, options_, context_);
      wanted.assign(wanted.size(), 0);
      for (const std::size_t c : settled_.unstorable) want_anew(c, wanted);
      if (any_flag(wanted)) continue;
      if (!settled_.unstorable.empty()) throw_unstorable();
      certify::Parametrization map = finished();
      for (const FaceId f : map.certificate.failed_faces) want_anew(chart_of_face_[at(f)], wanted);
      if (map.certificate.ok || !any_flag(wanted)) {
        certify::require_certificate(map, "The repaired map");
        return map;
      }
    }
  }

  // c: a chart of the result. That of the given map which it comes from is made anew, once.
  void want_anew(std::size_t c, std::vector<char>& wanted) {
    const std::size_t given = source_[c];
    if (anew_[given] != 0 || mended_[given].change == Change::kAnew) return;
    wanted[given] = anew_[given] = 1;
  }

  [[noreturn]] void throw_unstorable() const {
    const mesh::Chart& chart = charts_[settled_.unstorable.front()];
    throw_not_converged(ErrorCode::kRoundingFlips,
                        "The chart of face " + face_id(chart.faces.front()) +
                            " has triangles too small for the 32 bits that are stored. Enlarge it, "
                            "or mark seams that cut its long and thin parts off.",
                        ElementKind::kFace, {chart.faces.front()});
  }

  void mend_one(std::size_t c, ExecutionContext& context) {
    const ChartToMend chart{given_.charts[c],
                            given_.vertex_origin,
                            seen_.places[c],
                            given_.unknown[c],
                            seen_.pins[c],
                            part_of(given_.charts[c], seams_),
                            part_of(given_.charts[c], uncuttable_),
                            density_};
    mended_[c] = mend_chart(chart, options_, anew_[c] != 0, context);
    judge_stretched(chart, options_, mended_[c], context);
  }

  void mend(const std::vector<char>& wanted) {
    std::vector<std::size_t> chosen;
    for (std::size_t c = 0; c < wanted.size(); ++c) {
      if (wanted[c] != 0) chosen.push_back(c);
    }
    chosen = largest_first(given_.charts, std::move(chosen));
    for_each_chart(given_.charts, chosen, "mending charts", context_,
                   [&](std::size_t c, ExecutionContext& part) { mend_one(c, part); });
  }

  // The charts of the result, from the mended ones and their further cuts.
  void collect() {
    const std::size_t corners = 3 * at(static_cast<Index>(surface_.faces.rows()));
    uv_.resize(static_cast<Eigen::Index>(corners), 2);
    mesh::EdgeFlags cuts = given_.cuts;
    std::vector<Place> place(corners / 3, Place::kStays);
    std::vector<char> remade(corners / 3);
    std::vector<std::size_t> given_chart(corners / 3);
    sized_ = true;
    Points2 before;  // that stretched islands were made better
    for (const MendedChart& mended : mended_) {
      if (mended.before.rows() > 0) before.resize(uv_.rows(), 2);
    }
    for (std::size_t c = 0; c < mended_.size(); ++c) {
      const mesh::Chart& chart = given_.charts[c];
      const Points2& own_before = mended_[c].before.rows() > 0 ? mended_[c].before : mended_[c].uv;
      sized_ = sized_ && mended_[c].has_density;
      for (std::size_t h = 0; h < 3 * chart.faces.size(); ++h) {
        const std::size_t corner = corner_of(chart, h);
        const auto stored_place = [&](const Points2& uv) {
          return certify::row_from_texture(uv.row(static_cast<Eigen::Index>(h)), options_.aspect,
                                           given_.places[c].row(chart.surface.faces.data()[h]));
        };
        uv_.row(static_cast<Eigen::Index>(corner)) = stored_place(mended_[c].uv);
        if (before.rows() > 0)
          before.row(static_cast<Eigen::Index>(corner)) = stored_place(own_before);
        if (!mended_[c].cut.empty()) cuts[corner] |= mended_[c].cut[h];
        place[corner / 3] = mended_[c].place[h / 3];
        remade[corner / 3] = mended_[c].remade[h / 3];
        given_chart[corner / 3] = c;
      }
    }
    cuts_ = std::move(cuts);
    charts_ = mesh::split_into_charts(surface_.vertices,
                                      mesh::cut_along(surface_.faces, adjacency_, cuts_));
    chart_of_face_.resize(corners / 3);
    source_.clear();
    to_settle_.clear();
    for (std::size_t c = 0; c < charts_.size(); ++c) {
      const mesh::Chart& chart = charts_[c];
      ChartToSettle& own = to_settle_.emplace_back();
      source_.push_back(given_chart[at(chart.faces.front())]);
      own.place = place[at(chart.faces.front())];
      own.uv = by_vertex(chart, uv_);
      if (mended_[source_.back()].before.rows() > 0) own.before = by_vertex(chart, before);
      for (const FaceId f : chart.faces) chart_of_face_[at(f)] = c;
    }
    for (const certify::CornerPin& pin : options_.pins) {
      const std::size_t c = chart_of_face_[at(pin.corner / 3)];
      const mesh::Chart& chart = charts_[c];
      const auto f = std::lower_bound(chart.faces.begin(), chart.faces.end(), pin.corner / 3) -
                     chart.faces.begin();
      to_settle_[c].kept.fixed.push_back(chart.surface.faces(f, pin.corner % 3));
    }
    if (options_.stretched == StretchedIslands::kImprove && sized_) take_one_scale(remade);
    parallel_for(context_, charts_.size(), 16,
                 [&](std::size_t begin, std::size_t end, std::size_t) {
                   const ExecutionContext part(&context_, 1);
                   for (std::size_t c = begin; c < end; ++c)
                     to_settle_[c].kept.bijective =
                         !overlaps_itself(charts_[c].surface.faces, to_settle_[c].uv, part);
                 });
  }

  // Where most of what stands has one scale. remade: per face.
  void take_one_scale(const std::vector<char>& remade) {
    std::vector<double> densities;
    std::vector<char> of_chart;
    for (std::size_t c = 0; c < charts_.size(); ++c) {
      densities.push_back(median_density(charts_[c].surface,
                                         certify::on_texture(to_settle_[c].uv, options_.aspect)));
      of_chart.push_back(remade[at(charts_[c].faces.front())]);
    }
    const double density = common(charts_, densities, of_chart);
    for (std::size_t c = 0; c < charts_.size(); ++c) {
      const double factor = density / densities[c];
      if (of_chart[c] == 0 || !std::isnormal(factor) || factor == 1.0) continue;
      const Points2& uv = to_settle_[c].uv;
      const Eigen::RowVector2d middle = uv.colwise().mean();
      Points2 other = (factor * (uv.rowwise() - middle)).rowwise() + middle;
      if (distortion::is_flip_free(charts_[c].surface.faces, other, context_))
        to_settle_[c].uv = std::move(other);
    }
  }

  certify::Parametrization finished() {
    const Grace finishing(context_);
    context_.report("certifying", 0.95);
    certify::Parametrization map =
        map_of_charts(surface_, mesh::flagged_edges(surface_.faces, adjacency_, cuts_), charts_,
                      settled_.uv, settled_.stored);
    map.stats = stats_;
    certify::CertifyRequest request;
    request.pins = options_.pins;
    request.require_bijective = options_.overlaps != SelfOverlaps::kKeep;
    request.require_disjoint = options_.disjoint && options_.pins.empty();
    request.aspect = options_.aspect;
    certify::certify_map(map, surface_, request, context_);
    count(map);
    return map;
  }

  void count(certify::Parametrization& map) const {
    Stats& stats = map.stats;
    const auto changed = [&](Change change) {
      return static_cast<std::int64_t>(
          std::count_if(mended_.begin(), mended_.end(),
                        [&](const MendedChart& chart) { return chart.change == change; }));
    };
    stats["charts"] = static_cast<std::int64_t>(charts_.size());
    stats["charts_mirrored"] = changed(Change::kMirrored);
    stats["charts_unfolded"] = changed(Change::kUnfolded);
    stats["charts_anew"] = changed(Change::kAnew);
    stats["charts_cut"] = static_cast<std::int64_t>(std::count_if(
        mended_.begin(), mended_.end(), [](const MendedChart& chart) { return chart.was_cut; }));
    const auto stretched = [&](std::int64_t StretchedPieces::*count) {
      std::int64_t sum = 0;
      for (const MendedChart& chart : mended_) sum += chart.stretched.*count;
      return sum;
    };
    stats["charts_improved"] = stretched(&StretchedPieces::improved);
    stats["charts_stretched_anew"] = stretched(&StretchedPieces::anew);
    stats["stretched_charts"] = stretched(&StretchedPieces::left);
    stats["charts_moved"] =
        static_cast<std::int64_t>(std::count(settled_.moved.begin(), settled_.moved.end(), 1));
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
  Points2 uv_;
  mesh::EdgeFlags cuts_;
  std::vector<mesh::Chart> charts_;
  std::vector<ChartToSettle> to_settle_;
  std::vector<std::size_t> source_;  // per chart: of the given map
  std::vector<std::size_t> chart_of_face_;
  bool sized_ = true;
  SettledCharts settled_;
};

// As repair() says, without "seconds".
certify::Parametrization repair_clean(const mesh::Surface& surface, const Points2& corner_uv,
                                      const RepairOptions& options, ExecutionContext& context) {
  return Repair(surface, corner_uv, options, context).run();
}

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
      separated.solve([&] { return repair_clean(separated.surface(), own_uv, own, context); });
  certify::CertifyRequest request;
  request.pins = options.pins;
  request.aspect = options.aspect;
  certify::Parametrization map = separated.on_input(solved, request, context);
  follow_neighbours(separated.separated().collapsed, surface, corner_uv, options.pins, map);
  return map;
}

certify::Parametrization repair_any(const mesh::Surface& surface, const Points2& corner_uv,
                                    const RepairOptions& options, ExecutionContext& context) {
  certify::Parametrization map = repair_separated(surface, corner_uv, options, context);
  const Grace judging(context);
  certify::CertifyRequest request;
  request.surface = &surface;
  request.uv = &map.uv;
  request.uv32 = &map.uv32;
  request.pins = options.pins;
  request.require_bijective = options.overlaps != SelfOverlaps::kKeep;
  request.require_disjoint = options.disjoint && options.pins.empty();
  request.aspect = options.aspect;
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
                           ? repair_clean(surface, corner_uv, options, context)
                           : repair_any(surface, corner_uv, options, context);
                   map.stats["seconds"] = watch.seconds();
                   const Grace finishing(context);
                   context.report("done", 1.0);
                   return map;
                 });
}

}  // namespace flipfree::unwrap
