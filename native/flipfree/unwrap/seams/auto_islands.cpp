#include "flipfree/unwrap/seams/auto_islands.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <utility>

#include "flipfree/base/disjoint_sets.h"
#include "flipfree/base/error.h"
#include "flipfree/base/failure.h"
#include "flipfree/certify/separated_map.h"
#include "flipfree/mesh/face_area.h"
#include "flipfree/mesh/shortest_paths.h"
#include "flipfree/unwrap/chart/chart.h"
#include "flipfree/unwrap/chart/separate.h"
#include "flipfree/unwrap/islands/islands.h"
#include "flipfree/unwrap/islands/sheet.h"
#include "flipfree/unwrap/packing/layout.h"
#include "flipfree/unwrap/seams/costs.h"
#include "flipfree/unwrap/seams/nets.h"
#include "flipfree/unwrap/seams/search.h"
#include "flipfree/unwrap/seams/tubes.h"

namespace flipfree::unwrap {
namespace {

// What a seam costs grows with the root of how much is seen there, between these.
constexpr double kHidden = 0.5;
constexpr double kSeen = 2.0;

bool is_within(const Stretch& bound, const mesh::Surface& chart, const Points2& uv) {
  return stretch_of(chart, by_corner(chart.faces, uv)).within(bound);
}

// Charts are searched again, for what they have become since, with a bound that is tighter by this.
constexpr int kSearchRounds = 4;
constexpr double kTighterEachRound = 0.8;

class IslandFinder {
 public:
  IslandFinder(const mesh::Surface& surface, const mesh::Surface& placed,
               const mesh::EdgeFlags& seams, const mesh::EdgeFlags& uncuttable,
               const UnwrapOptions& options, std::vector<double> cost, ExecutionContext& context,
               Stats& stats)
      : surface_(surface),
        placed_(placed),
        seams_(seams),
        uncuttable_(uncuttable),
        options_(options),
        bound_(stretch_bound(options.seams.stretch)),
        context_(context),
        stats_(stats),
        cost_(std::move(cost)),
        known_(surface.faces) {}

  AutoIslands run(const Mirror& mirror) {
    try {
      find(mirror);
    } catch (const TimeIsOver&) {
      // Where seams alone are asked for, those that there are will do.
      if (!options_.seams.edges_only || islands_.charts.empty()) throw;
      uv_.clear();
    }
    return {std::move(islands_), std::move(uv_)};
  }

 private:
  void find(const Mirror& mirror) {
    mesh::EdgeFlags wanted =
        with_sharp_edges(surface_, seams_, never_seams(cost_), options_.seams.sharp_angle);
    const Tubes tubes = find_tubes(surface_, wanted, cost_, options_.polygon, bound_);
    const mesh::EdgeFlags nets = nets_beside(tubes, wanted, mirror);
    const mesh::EdgeFlags& first = any_flag(seams_) ? seams_ : wanted;
    double begin = 0.0;
    if (any_flag(first) || any_flag(nets)) {
      open(first, {});
      begin = 0.2;
      const ProgressRange range(context_, 0.0, begin);
      add_known(first, nets);
      if (all_known(known_)) return flatten();
    }
    // Where nets leave nothing to be opened, what is seen decides nothing yet.
    if (!any_flag(nets)) prefer_hidden();
    const bool by_seams = any_flag(seams_);
    for (std::size_t h = 0; h < cost_.size(); ++h) {
      if (known_.of_face[h / 3] == KnownMaps::kNothing) {
        wanted[h] |= nets[h];
        continue;
      }
      cost_[h] = mesh::ShortestPaths::kUnreached;
      if (by_seams) wanted[h] = seams_[h];
    }
    open(wanted, positive(surface_, cost_));
    if (!is_seen_ && any_flag(islands_.added)) {
      prefer_hidden();
      open(wanted, positive(surface_, cost_));
    }
    for (const mesh::Chart& chart : islands_.charts) {
      const FaceId f = chart.faces.front();
      if (known_.of_face[at(f)] == KnownMaps::kNothing && tubes.of_face[at(f)] != 0)
        take_down(chart, by_vertex(chart, tubes.corner_uv), KnownMaps::kFlat);
    }
    if (any_flag(nets)) {
      const ProgressRange range(context_, begin, begin + 0.1);
      begin += 0.1;
      add_known(nets, {});
      if (all_known(known_)) return flatten();
    }
    prefer_hidden();
    const ProgressRange range(context_, begin, 1.0);
    search_until_within();
  }

  // Once.
  void prefer_hidden() {
    if (std::exchange(is_seen_, true)) return;
    const Triangles& faces = placed_.faces;
    const std::vector<double> seen_at = exposure(placed_, context_);
    for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(cost_.size()); ++h) {
      const double seen =
          0.5 * (seen_at[at(mesh::source(faces, h))] + seen_at[at(mesh::target(faces, h))]);
      cost_[at(h)] *= std::clamp(std::sqrt(seen), kHidden, kSeen);
    }
  }

  // The cuts of tubes, and nets of all else.
  mesh::EdgeFlags nets_beside(const Tubes& tubes, const mesh::EdgeFlags& seams,
                              const Mirror& mirror) const {
    mesh::EdgeFlags nets = seams;
    for (std::size_t h = 0; h < nets.size(); ++h) nets[h] |= tubes.cut[h];
    nets = net_seams(surface_, nets, mirrored_costs(surface_.faces, mirror, cost_), tubes.is_rim,
                     context_);
    for (std::size_t h = 0; h < nets.size(); ++h)
      if (tubes.of_face[h / 3] != 0 || tubes.cut[h] != 0) nets[h] = tubes.cut[h];
    return nets;
  }

  // cost: per half-edge, or empty: of cuts, instead of lengths.
  void open(const mesh::EdgeFlags& cut, std::vector<double> cost) {
    islands_ = make_islands(surface_, cut, uncuttable_, context_, {{}, std::move(cost), false});
  }

  void flatten() {
    uv_ = flatten_islands(islands_, surface_, uncuttable_, ChartPins{}, options_, context_, stats_,
                          &known_);
  }

  char known(const mesh::Chart& chart) const { return known_.of_face[at(chart.faces.front())]; }

  static bool all_known(const KnownMaps& maps) {
    return std::ranges::find(maps.of_face, KnownMaps::kNothing) == maps.of_face.end();
  }

  // The map (#V x 2) of a chart, as known.
  void take_down(const mesh::Chart& chart, const Points2& uv, char kind) {
    put_corners(chart, uv, known_.corner_uv);
    for (const FaceId f : chart.faces) known_.of_face[at(f)] = kind;
  }

  // Adds the maps of the islands that `seams` bound, or that nets would cut, none of which had to
  // be opened, within the bound of stretch and not on themselves: what is cut well enough is cut no
  // further.
  void add_known(const mesh::EdgeFlags& seams, const mesh::EdgeFlags& nets) {
    KnownMaps passed = known_;  // the others are passed over as if they were known
    for (const mesh::Chart& chart : islands_.charts) {
      const std::vector<HalfedgeId>& opposite = chart.surface.adjacency().opposite;
      const bool in_nets = any_flag(part_of(chart, nets));
      bool bounded = false;
      for (std::size_t h = 0; h < opposite.size() && !bounded; ++h)
        bounded = opposite[h] == kInvalid && (in_nets || seams[corner_of(chart, h)] != 0);
      if (bounded && !any_flag(part_of(chart, islands_.added))) continue;
      for (const FaceId f : chart.faces) passed.of_face[at(f)] = KnownMaps::kFlat;
    }
    if (all_known(passed)) return;
    // What cannot be flattened whole is searched like what is stretched, and so is what lies on
    // itself: nets with many holes take minutes to be held apart, and are cut in the end.
    UnwrapOptions whole = options_;
    whole.bijective = false;
    Outcome<std::vector<Points2>> uv = attempt([&] {
      return flatten_islands(islands_, surface_, uncuttable_, ChartPins{}, whole, context_, stats_,
                             &passed);
    });
    for (std::size_t c = 0; c < islands_.charts.size() && uv; ++c) {
      const mesh::Surface& chart = islands_.charts[c].surface;
      const FaceId first = islands_.charts[c].faces.front();
      if (passed.of_face[at(first)] == KnownMaps::kNothing && is_within(bound_, chart, (*uv)[c]) &&
          !(options_.bijective && overlaps_itself(chart.faces, (*uv)[c], context_)))
        take_down(islands_.charts[c], (*uv)[c], KnownMaps::kFlat);
    }
  }

  void search_until_within() {
    Stretch aim = bound_;
    double begin = 0.0;
    for (int round = 0;; ++round) {
      const double end = begin + 0.5 * (1.0 - begin);
      if (round < kSearchRounds) {
        const ProgressRange range(context_, begin, begin + 0.7 * (end - begin));
        search(aim);
      }
      const ProgressRange range(context_, begin + 0.7 * (end - begin), end);
      begin = end;
      flatten();
      if (!any_above()) return;
      if (context_.time_is_over() || (options_.acceptable && context_.accepted())) {
        note_time_limit(stats_);
        return;
      }
      if (round + 1 >= kSearchRounds && !halve()) return;
      aim.energy = 1.0 + kTighterEachRound * (aim.energy - 1.0);
    }
  }

  // Slits for the charts without a map that is known, and maps for those that can have one.
  void search(const Stretch& aim) {
    mesh::EdgeFlags further(cost_.size(), 0);
    try {
      for_each_chart(islands_.charts, largest_first(islands_.charts), "finding seams", context_,
                     [&](std::size_t c, ExecutionContext& part) {
                       if (known(islands_.charts[c]) == KnownMaps::kNothing)
                         search_chart(islands_.charts[c], aim, further, part);
                     });
    } catch (const TimeIsOver&) {
      cut_further(islands_, surface_, further);  // what was found by then
      throw;
    }
    cut_further(islands_, surface_, further);
  }

  void search_chart(const mesh::Chart& chart, const Stretch& aim, mesh::EdgeFlags& further,
                    ExecutionContext& context) {
    const mesh::InOwnUnit own(chart.surface);
    std::vector<double> cost = part_of(chart, cost_);
    for (double& c : cost) c /= own.unit();
    const Slits slits = find_slits(own.surface(), cost, aim, options_, context);
    put_part(chart, slits.cut, further);
    for (std::size_t h = 0; h < at(slits.corner_uv.rows()); ++h) {
      const std::size_t corner = corner_of(chart, h);
      known_.corner_uv.row(static_cast<Eigen::Index>(corner)) =
          own.unit() * slits.corner_uv.row(static_cast<Eigen::Index>(h));
      known_.of_face[corner / 3] = slits.divided ? KnownMaps::kPiece : KnownMaps::kFlat;
    }
  }

  // Cuts the charts in two of which no map is known, in the sense of any_above(). False if none can
  // be.
  bool halve() {
    if (!options_.may_add_cuts) return false;
    mesh::EdgeFlags further(cost_.size(), 0);
    for (const mesh::Chart& chart : islands_.charts) {
      if (known(chart) != KnownMaps::kNothing) continue;
      const Points2 uv = by_vertex(chart, known_.corner_uv);
      const mesh::EdgeFlags cut =
          halving_cut(chart.surface, uv, never_seams(part_of(chart, cost_)), false, context_);
      put_part(chart, cut, further);
      const char kind = any_flag(cut) ? KnownMaps::kPiece : KnownMaps::kFlat;
      for (const FaceId f : chart.faces) known_.of_face[at(f)] = kind;
    }
    cut_further(islands_, surface_, further);
    return any_flag(further);
  }

  // Takes down the maps, but of charts above the bound. True if there are such.
  bool any_above() {
    for (std::size_t c = 0; c < islands_.charts.size(); ++c) {
      const mesh::Chart& chart = islands_.charts[c];
      const bool within = is_within(bound_, chart.surface, uv_[c]);
      take_down(chart, uv_[c], within ? KnownMaps::kFlat : KnownMaps::kNothing);
    }
    return !all_known(known_);
  }

  const mesh::Surface& surface_;  // in its own unit
  const mesh::Surface& placed_;   // where the user has it
  const mesh::EdgeFlags& seams_;
  const mesh::EdgeFlags& uncuttable_;
  const UnwrapOptions& options_;
  const Stretch bound_;
  ExecutionContext& context_;
  Stats& stats_;
  std::vector<double> cost_;  // per half-edge
  bool is_seen_ = false;      // how much is seen has its share in them
  KnownMaps known_;
  Islands islands_;
  std::vector<Points2> uv_;  // per chart, once all are flat
};

// What symmetric seams may cost, over what was found.
constexpr double kMostForSymmetry = 1.28;
// What a further island costs, as a share of all seams.
constexpr double kPriceOfIsland = 0.03;
// More islands than were found only for nets, which are not stretched.
constexpr Stretch kNets = {1.002, 1.2};

// Seams as they are on this side of the plane, and their images; 0: those of both sides.
mesh::EdgeFlags mirrored_cut(const mesh::EdgeFlags& cut, const Mirror& mirror, int side) {
  mesh::EdgeFlags result = cut;
  for (std::size_t h = 0; h < cut.size(); ++h) {
    const HalfedgeId image = mirror.edge[h];
    if (image == kInvalid || mirror.side[h] * side > 0) continue;
    result[h] = cut[at(image)];
    if (mirror.side[h] * side == 0) result[h] |= cut[h];
  }
  return result;
}

// Islands that a plane maps onto each other, and what is made of them.
class Symmetrizer {
 public:
  Symmetrizer(const AutoIslands& found, const mesh::Surface& surface,
              const mesh::EdgeFlags& uncuttable, const std::vector<double>& cost,
              const Mirror& mirror, const UnwrapOptions& options, ExecutionContext& context)
      : found_(found.islands),
        surface_(surface),
        uncuttable_(uncuttable),
        cost_(cost),
        options_(options),
        context_(context),
        area_(mesh::area_of(surface)),
        cut_(found_.cut),
        before_(surface.faces.size(), 2) {
    std::vector<Index> island(at(surface.faces.rows()));
    for (std::size_t c = 0; c < found.uv.size(); ++c) {
      for (const FaceId f : found_.charts[c].faces) island[at(f)] = static_cast<Index>(c);
      put_corners(found_.charts[c], found.uv[c], before_);
    }
    corner_uv_ = before_;
    const std::vector<HalfedgeId>& opposite = surface.adjacency().opposite;
    DisjointSets sets(static_cast<Index>(found.uv.size()));
    for (std::size_t h = 0; h < cut_.size(); ++h) {
      const HalfedgeId image = mirror.edge[h];
      if (image == kInvalid || opposite[h] == kInvalid || cut_[h] != 0) continue;
      for (const HalfedgeId other : {image, opposite[at(image)]})
        sets.join(island[h / 3], island[at(other / 3)]);
    }
    for (const Index i : island) group_.push_back(sets.find(i));
    count_ = counts(found_);
    most_ = prices(cut_, count_);
    for (double& most : most_) most *= kMostForSymmetry;
  }

  // Takes seams of a side for the groups in which they are usable, and cost less than what is
  // there.
  void use(const mesh::EdgeFlags& cut) {
    const Islands islands = make_islands(surface_, cut, uncuttable_, context_);
    const std::vector<std::size_t> count = counts(islands);
    const std::vector<double> price = prices(cut, count);
    std::vector<char> is_better(most_.size(), 0);
    for (std::size_t g = 0; g < most_.size(); ++g) is_better[g] = price[g] <= most_[g] ? 1 : 0;
    for (std::size_t h = 0; h < cut.size(); ++h)
      if (islands.added[h] != 0) is_better[at(group_[h / 3])] = 0;
    Points2 corner_uv = before_;
    for (const mesh::Chart& chart : islands.charts) {
      const std::size_t group = group_of(chart);
      const mesh::EdgeFlags own = part_of(chart, cut);
      const mesh::EdgeFlags before = part_of(chart, found_.cut);
      if (is_better[group] == 0 || own == before) continue;
      const bool has_more = count[group] > count_[group];
      const Stretch bound = has_more ? kNets : stretch_bound(options_.seams.stretch);
      const bool is_part = std::equal(own.begin(), own.end(), before.begin(), std::greater_equal());
      if ((has_more && mesh::area_of(chart.surface) < kSliver * area_) ||
          !lay_flat(chart, is_part, bound, corner_uv))
        is_better[group] = 0;
    }
    for (std::size_t h = 0; h < cut.size(); ++h) {
      if (is_better[at(group_[h / 3])] == 0) continue;
      cut_[h] = cut[h];
      const auto row = static_cast<Eigen::Index>(h);
      corner_uv_.row(row) = corner_uv.row(row);
      most_[at(group_[h / 3])] = price[at(group_[h / 3])];
    }
  }

  AutoIslands result() const {
    AutoIslands result{make_islands(surface_, cut_, uncuttable_, context_), {}};
    for (const mesh::Chart& chart : result.islands.charts)
      result.uv.push_back(by_vertex(chart, corner_uv_));
    for (std::size_t h = 0; h < cut_.size(); ++h) {
      const bool was_given = found_.cut[h] != 0 && found_.added[h] == 0;
      result.islands.added[h] = result.islands.cut[h] != 0 && !was_given ? 1 : 0;
    }
    return result;
  }

 private:
  std::size_t group_of(const mesh::Chart& chart) const { return at(group_[at(chart.faces[0])]); }

  // Per group, as what follows.
  std::vector<std::size_t> counts(const Islands& islands) const {
    std::vector<std::size_t> count(found_.charts.size(), 0);
    for (const mesh::Chart& chart : islands.charts) ++count[group_of(chart)];
    return count;
  }
  std::vector<double> prices(const mesh::EdgeFlags& cut,
                             const std::vector<std::size_t>& islands) const {
    std::vector<double> price(islands.size(), 0.0);
    for (std::size_t h = 0; h < cut.size(); ++h)
      if (cut[h] != 0) price[at(group_[h / 3])] += std::min(cost_[h], kForbidden);
    for (std::size_t g = 0; g < price.size(); ++g)
      price[g] *= 1.0 + kPriceOfIsland * static_cast<double>(islands[g]);
    return price;
  }

  // False if the island is no map within the bound. A part of what was keeps its map, unless it
  // has one without stretch.
  bool lay_flat(const mesh::Chart& chart, bool is_part, const Stretch& bound,
                Points2& corner_uv) const {
    const mesh::InOwnUnit own(chart.surface);
    const bool keeps = is_part && is_within(bound, chart.surface, by_vertex(chart, corner_uv));
    FlattenOptions flatten(options_);
    for (const bool bijective : {false, true}) {
      Stats ignored;
      flatten.bijective = bijective;
      Outcome<FlatChart> flat =
          attempt([&] { return flatten_chart(own.surface(), flatten, context_, ignored); });
      if (!flat) return keeps;
      flat->uv *= own.unit();
      const bool is_net = is_within(kNets, chart.surface, flat->uv);
      if (!is_net && (keeps || !is_within(bound, chart.surface, flat->uv))) return keeps;
      if (bijective || !options_.bijective) {
        put_corners(chart, flat->uv, corner_uv);
        return true;
      }
      // What is not stretched gives no way.
      if (is_net && overlaps_itself(chart.surface.faces, flat->uv, context_)) return keeps;
    }
    return keeps;
  }

  const Islands& found_;
  const mesh::Surface& surface_;
  const mesh::EdgeFlags& uncuttable_;
  const std::vector<double>& cost_;
  const UnwrapOptions& options_;
  ExecutionContext& context_;
  const double area_;
  mesh::EdgeFlags cut_;
  Points2 before_;
  Points2 corner_uv_;
  std::vector<Index> group_;        // per face
  std::vector<std::size_t> count_;  // per group: islands that were found
  std::vector<double> most_;        // per group: what its seams may cost
};

}  // namespace

AutoIslands find_islands(const mesh::Surface& surface, const mesh::Surface& placed,
                         const mesh::EdgeFlags& seams, const mesh::EdgeFlags& uncuttable,
                         const UnwrapOptions& options, ExecutionContext& context, Stats& stats) {
  const std::vector<double> cost = edge_costs(surface, uncuttable, options.seams);
  const Mirror mirror = find_mirror(mesh::InOwnUnit(placed).surface(), cost);
  AutoIslands found;
  {
    const ProgressRange range(context, 0.0, 0.95);
    found =
        IslandFinder(surface, placed, seams, uncuttable, options, cost, context, stats).run(mirror);
  }
  if (found.uv.empty() || mirror.empty()) return found;
  const ProgressRange range(context, 0.95, 1.0);
  const mesh::EdgeFlags& cut = found.islands.cut;
  if (mirrored_cut(cut, mirror, 0) == cut || mirrored_cut(seams, mirror, 0) != seams) return found;
  Symmetrizer symmetrizer(found, surface, uncuttable, cost, mirror, options, context);
  ended_in_time([&] {
    for (const int side : {1, -1, 0}) symmetrizer.use(mirrored_cut(cut, mirror, side));
  });
  return symmetrizer.result();
}

namespace {

IndexPairs find_on_clean(const mesh::Surface& surface, const UnwrapOptions& options,
                         ExecutionContext& context) {
  const mesh::Adjacency& adjacency = surface.adjacency();
  const mesh::EdgeFlags seams = mesh::flag_edges(surface.faces, adjacency, options.cuts);
  const mesh::EdgeFlags uncuttable = flags_of(surface, options.uncuttable);
  const mesh::Surface working{normalised(surface.vertices, surface.faces), surface.faces};
  UnwrapOptions own = options;
  own.seams.edges_only = true;
  own.acceptable = false;
  Stats ignored;
  const mesh::EdgeFlags cut =
      find_islands(working, surface, seams, uncuttable, own, context, ignored).islands.cut;
  return mesh::flagged_edges(surface.faces, adjacency, cut);
}

}  // namespace

IndexPairs find_seams(const mesh::Surface& surface, const UnwrapOptions& options,
                      ExecutionContext& context) {
  const auto find_any = [&] {
    context.report("checking the mesh", 0.0);
    if (certify::is_clean(surface, context)) return find_on_clean(surface, options, context);
    const certify::SeparatedMap separated(surface, separating(options), context);
    const UnwrapOptions own = on_separated(separated, options);
    return separated.edges_of_input(
        separated.solve([&] { return find_on_clean(separated.surface(), own, context); }));
  };
  return in_time(context, options.max_seconds, "No seams were found", "or find them part by part",
                 [&] {
                   const IndexPairs seams = find_any();
                   const Grace finishing(context);
                   context.report("done", 1.0);
                   return seams;
                 });
}

}  // namespace flipfree::unwrap
