#include "flipfree/unwrap/seams/auto_islands.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "flipfree/base/error.h"
#include "flipfree/base/failure.h"
#include "flipfree/base/parallel.h"
#include "flipfree/certify/separated_map.h"
#include "flipfree/mesh/face_area.h"
#include "flipfree/mesh/shortest_paths.h"
#include "flipfree/unwrap/chart/chart.h"
#include "flipfree/unwrap/chart/separate.h"
#include "flipfree/unwrap/islands/islands.h"
#include "flipfree/unwrap/packing/layout.h"
#include "flipfree/unwrap/seams/costs.h"
#include "flipfree/unwrap/seams/nets.h"
#include "flipfree/unwrap/seams/search.h"
#include "flipfree/unwrap/seams/sheet.h"
#include "flipfree/unwrap/seams/symmetric.h"
#include "flipfree/unwrap/seams/tubes.h"

namespace flipfree::unwrap {
namespace {

// Edges that must not be seams, but there may be no other way to open a closed surface.
std::vector<double> positive(const mesh::Surface& surface, std::vector<double> cost) {
  constexpr double kForbidden = 1e6;
  constexpr double kLeast = 1e-12;
  for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(cost.size()); ++h) {
    const double most = std::max(kForbidden * edge_length(surface, h), kLeast);
    cost[at(h)] = std::clamp(cost[at(h)], kLeast, most);
  }
  return cost;
}

// What a seam costs grows with the root of how much is seen there, between these.
constexpr double kHidden = 0.5;
constexpr double kSeen = 2.0;

void prefer_hidden(std::vector<double>& cost, const Triangles& faces,
                   const std::vector<double>& exposure) {
  for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(cost.size()); ++h) {
    const double seen =
        0.5 * (exposure[at(mesh::source(faces, h))] + exposure[at(mesh::target(faces, h))]);
    cost[at(h)] *= std::clamp(std::sqrt(seen), kHidden, kSeen);
  }
}

KnownMaps nothing_known(const Triangles& faces) {
  return {Points2(3 * faces.rows(), 2), std::vector<char>(at(faces.rows()), KnownMaps::kNothing)};
}

bool all_known(const KnownMaps& known) {
  const auto& of_face = known.of_face;
  return std::find(of_face.begin(), of_face.end(), KnownMaps::kNothing) == of_face.end();
}

// The map (#V x 2) of a chart, as known.
void take_down(const mesh::Chart& chart, const Points2& uv, char kind, KnownMaps& known) {
  put_corners(chart, uv, known.corner_uv);
  for (const FaceId f : chart.faces) known.of_face[at(f)] = kind;
}

bool is_within(const Stretch& bound, const mesh::Surface& chart, const Points2& uv) {
  return stretch_of(chart, by_corner(chart.faces, uv)).within(bound);
}

void add_flags(const mesh::EdgeFlags& more, mesh::EdgeFlags& flags) {
  for (std::size_t h = 0; h < flags.size(); ++h) flags[h] |= more[h];
}

// Adds the maps of the islands that the given seams bound, or that nets would cut, none of which
// had to be opened, within the bound of stretch and not on themselves: what is cut well enough is
// cut no further.
void add_known(const mesh::Surface& surface, const mesh::Adjacency& adjacency,
               const mesh::EdgeFlags& seams, const mesh::EdgeFlags& nets,
               const mesh::EdgeFlags& uncuttable, Islands& islands, const UnwrapOptions& options,
               ExecutionContext& context, Stats& stats, KnownMaps& known) {
  KnownMaps passed = known;
  std::vector<char> candidate(islands.charts.size(), 0);
  for (std::size_t c = 0; c < candidate.size(); ++c) {
    const mesh::Chart& chart = islands.charts[c];
    if (known.of_face[at(chart.faces.front())] != KnownMaps::kNothing) continue;
    const mesh::Adjacency& local = chart.surface.adjacency();
    const bool opened = any_flag(part_of(chart, islands.added));
    const bool in_nets = any_flag(part_of(chart, nets));
    for (std::size_t h = 0; h < local.opposite.size() && !opened; ++h) {
      if (local.opposite[h] == kInvalid && (in_nets || seams[corner_of(chart, h)] != 0))
        candidate[c] = 1;
    }
    // The others are passed over as if they were known.
    if (candidate[c] == 0)
      for (const FaceId f : chart.faces) passed.of_face[at(f)] = KnownMaps::kFlat;
  }
  if (!any_flag(candidate)) return;
  // What cannot be flattened whole is searched like what is stretched, and so is what lies on
  // itself: nets with many holes take minutes to be held apart, and are cut in the end.
  UnwrapOptions whole = options;
  whole.bijective = false;
  Outcome<std::vector<Points2>> uv = attempt([&] {
    return flatten_islands(islands, surface, adjacency, uncuttable, ChartPins{}, whole, context,
                           stats, &passed);
  });
  if (!uv) return;
  const Stretch bound = stretch_bound(options.seams.stretch);
  for (std::size_t c = 0; c < candidate.size(); ++c) {
    const mesh::Surface& chart = islands.charts[c].surface;
    if (candidate[c] != 0 && is_within(bound, chart, (*uv)[c]) &&
        !(options.bijective && overlaps_itself(chart.faces, (*uv)[c], context)))
      take_down(islands.charts[c], (*uv)[c], KnownMaps::kFlat, known);
  }
}

// Charts are searched again, for what they have become since, with a bound that is tighter by this.
constexpr int kSearchRounds = 4;
constexpr double kTighterEachRound = 0.8;

class Finder {
 public:
  Finder(const mesh::Surface& surface, const mesh::Adjacency& adjacency,
         const mesh::EdgeFlags& uncuttable, const UnwrapOptions& options, std::vector<double> cost,
         Islands islands, KnownMaps known)
      : surface_(surface),
        adjacency_(adjacency),
        uncuttable_(uncuttable),
        options_(options),
        cost_(std::move(cost)),
        islands_(std::move(islands)),
        known_(std::move(known)) {}

  AutoIslands run(ExecutionContext& context, Stats& stats) {
    const Stretch bound = stretch_bound(options_.seams.stretch);
    Stretch aim = bound;
    std::vector<Points2> uv;
    double begin = 0.0;
    for (int round = 0;; ++round) {
      const double end = begin + 0.5 * (1.0 - begin);
      if (round < kSearchRounds) {
        const ProgressRange range(context, begin, begin + 0.7 * (end - begin));
        search(aim, context);
      }
      const ProgressRange range(context, begin + 0.7 * (end - begin), end);
      begin = end;
      try {
        uv = flatten_islands(islands_, surface_, adjacency_, uncuttable_, ChartPins{}, options_,
                             context, stats, &known_);
      } catch (const TimeIsOver&) {
        if (options_.seams.edges_only) break;
        throw;
      }
      if (!any_above(bound, uv)) break;
      if (context.time_is_over() || (options_.acceptable && context.accepted())) {
        note_time_limit(stats);
        break;
      }
      if (round + 1 >= kSearchRounds && !halve(context)) break;
      aim.energy = 1.0 + kTighterEachRound * (aim.energy - 1.0);
    }
    return {std::move(islands_), std::move(uv)};
  }

 private:
  // Slits for the charts without a map that is known, and maps for those that can have one.
  void search(const Stretch& aim, ExecutionContext& context) {
    mesh::EdgeFlags further(adjacency_.opposite.size(), 0);
    const std::size_t count = islands_.charts.size();
    SharedProgress progress(context, 0.0);
    parallel_for(context, count, 1, [&](std::size_t c, std::size_t, std::size_t) {
      ExecutionContext part(&context, count == 1 ? context.threads : 1, &progress,
                            1.0 / static_cast<double>(count));
      if (known_.of_face[at(islands_.charts[c].faces.front())] == KnownMaps::kNothing)
        search_chart(islands_.charts[c], aim, further, part);
      const Grace done_with(part);
      part.report("finding seams", 1.0);
    });
    cut_further(islands_, surface_, adjacency_, further);
  }

  void search_chart(const mesh::Chart& chart, const Stretch& aim, mesh::EdgeFlags& further,
                    ExecutionContext& context) {
    const mesh::InOwnUnit own(chart.surface);
    const mesh::Adjacency& local = chart.surface.adjacency();
    std::vector<double> cost = part_of(chart, cost_);
    for (double& c : cost) c /= own.unit();
    const SlitOptions options{aim, options_.bijective, options_.may_add_cuts, options_.acceptable};
    const Slits slits = find_slits(own.surface(), local, cost, options, context);
    for (std::size_t h = 0; h < cost.size(); ++h) {
      const std::size_t corner = corner_of(chart, h);
      further[corner] = slits.cut[h];
      if (slits.corner_uv.rows() == 0) continue;
      const auto row = static_cast<Eigen::Index>(corner);
      const auto own_row = static_cast<Eigen::Index>(h);
      known_.corner_uv.row(row) = own.unit() * slits.corner_uv.row(own_row);
      known_.of_face[corner / 3] = slits.divided ? KnownMaps::kPiece : KnownMaps::kFlat;
    }
  }

  // Cuts the charts in two of which no map is known, in the sense of any_above(). False if none can
  // be.
  bool halve(ExecutionContext& context) {
    if (!options_.may_add_cuts) return false;
    mesh::EdgeFlags further(adjacency_.opposite.size(), 0);
    bool any = false;
    for (const mesh::Chart& chart : islands_.charts) {
      if (known_.of_face[at(chart.faces.front())] != KnownMaps::kNothing) continue;
      const mesh::EdgeFlags cut =
          halving_cut(chart.surface, chart.surface.adjacency(), by_vertex(chart, known_.corner_uv),
                      never_seams(part_of(chart, cost_)), false, context);
      const bool is_cut = any_flag(cut);
      any = any || is_cut;
      for (std::size_t h = 0; h < corner_count(chart); ++h) {
        const std::size_t corner = corner_of(chart, h);
        further[corner] = cut[h];
        known_.of_face[corner / 3] = is_cut ? KnownMaps::kPiece : KnownMaps::kFlat;
      }
    }
    cut_further(islands_, surface_, adjacency_, further);
    return any;
  }

  // Takes down the maps, but of charts above the bound. True if there are such.
  bool any_above(const Stretch& bound, const std::vector<Points2>& uv) {
    bool any = false;
    for (std::size_t c = 0; c < islands_.charts.size(); ++c) {
      const mesh::Chart& chart = islands_.charts[c];
      const bool within = is_within(bound, chart.surface, uv[c]);
      any = any || !within;
      take_down(chart, uv[c], within ? KnownMaps::kFlat : KnownMaps::kNothing, known_);
    }
    return any;
  }

  const mesh::Surface& surface_;
  const mesh::Adjacency& adjacency_;
  const mesh::EdgeFlags& uncuttable_;
  const UnwrapOptions& options_;
  std::vector<double> cost_;  // per half-edge
  Islands islands_;
  KnownMaps known_;
};

AutoIslands search_islands(const mesh::Surface& surface, const Points3& placed,
                           const mesh::Adjacency& adjacency, const mesh::EdgeFlags& seams,
                           const mesh::EdgeFlags& uncuttable, const Mirror& mirror,
                           std::vector<double> cost, const UnwrapOptions& options,
                           ExecutionContext& context, Stats& stats) {
  KnownMaps known = nothing_known(surface.faces);
  const auto known_flat = [&](Islands islands) -> AutoIslands {
    std::vector<Points2> uv = flatten_islands(islands, surface, adjacency, uncuttable, ChartPins{},
                                              options, context, stats, &known);
    return {std::move(islands), std::move(uv)};
  };
  // False where time is over and seams alone will do.
  const auto known_in_time = [&](const mesh::EdgeFlags& bounds, const mesh::EdgeFlags& of_nets,
                                 Islands& islands) {
    try {
      add_known(surface, adjacency, bounds, of_nets, uncuttable, islands, options, context, stats,
                known);
    } catch (const TimeIsOver&) {
      if (options.seams.edges_only) return false;
      throw;
    }
    return true;
  };
  double begin = 0.0;
  mesh::EdgeFlags wanted =
      with_sharp_edges(surface, adjacency, seams, never_seams(cost), options.seams.sharp_angle);
  const Tubes tubes = find_tubes(surface, adjacency, wanted, cost, options.polygon,
                                 stretch_bound(options.seams.stretch));
  mesh::EdgeFlags nets = wanted;
  add_flags(tubes.cut, nets);
  nets = net_seams(surface, adjacency, nets,
                   mirror.empty() ? cost : mirrored_costs(surface.faces, mirror, cost),
                   tubes.is_rim, context);
  for (std::size_t h = 0; h < nets.size(); ++h)
    if (tubes.of_face[h / 3] != 0 || tubes.cut[h] != 0) nets[h] = tubes.cut[h];
  const mesh::EdgeFlags& first = any_flag(seams) ? seams : wanted;
  if (any_flag(first) || any_flag(nets)) {
    Islands given =
        make_islands(surface, adjacency, first, uncuttable, false, context, {{}, {}, false});
    begin = 0.2;
    const ProgressRange range(context, 0.0, begin);
    if (!known_in_time(first, nets, given)) return {std::move(given), {}};
    if (all_known(known)) return known_flat(std::move(given));
  }
  const auto see = [&] {
    prefer_hidden(cost, surface.faces, exposure(placed, surface.faces, adjacency, context));
  };
  bool seen = !any_flag(nets);
  if (seen) see();
  const bool by_seams = any_flag(seams);
  for (std::size_t h = 0; h < cost.size(); ++h) {
    if (known.of_face[h / 3] == KnownMaps::kNothing) {
      wanted[h] |= nets[h];
      continue;
    }
    cost[h] = mesh::ShortestPaths::kUnreached;
    if (by_seams) wanted[h] = seams[h];
  }
  const auto open_islands = [&] {
    return make_islands(surface, adjacency, wanted, uncuttable, false, context,
                        {{}, positive(surface, cost), false});
  };
  Islands islands = open_islands();
  // Where nets leave nothing to be opened, what is seen decides nothing yet.
  if (!seen && any_flag(islands.added)) {
    see();
    seen = true;
    islands = open_islands();
  }
  for (const mesh::Chart& chart : islands.charts) {
    const FaceId f = chart.faces.front();
    if (known.of_face[at(f)] == KnownMaps::kNothing && tubes.of_face[at(f)] != 0)
      take_down(chart, by_vertex(chart, tubes.corner_uv), KnownMaps::kFlat, known);
  }
  if (any_flag(nets)) {
    const ProgressRange range(context, begin, begin + 0.1);
    begin += 0.1;
    if (!known_in_time(nets, {}, islands)) return {std::move(islands), {}};
    if (all_known(known)) return known_flat(std::move(islands));
  }
  if (!seen) see();
  const ProgressRange range(context, begin, 1.0);
  return Finder(surface, adjacency, uncuttable, options, std::move(cost), std::move(islands),
                std::move(known))
      .run(context, stats);
}
}  // namespace

AutoIslands find_islands(const mesh::Surface& surface, const Points3& placed,
                         const mesh::Adjacency& adjacency, const mesh::EdgeFlags& seams,
                         const mesh::EdgeFlags& uncuttable, const UnwrapOptions& options,
                         ExecutionContext& context, Stats& stats) {
  const std::vector<double> cost = edge_costs(surface, adjacency, uncuttable, options.seams);
  const mesh::Surface as_placed{placed, surface.faces};
  const Mirror mirror = find_mirror(mesh::InOwnUnit(as_placed).surface(), adjacency, cost);
  AutoIslands found;
  {
    const ProgressRange range(context, 0.0, 0.95);
    found = search_islands(surface, placed, adjacency, seams, uncuttable, mirror, cost, options,
                           context, stats);
  }
  const ProgressRange range(context, 0.95, 1.0);
  make_symmetric(found.islands, found.uv, surface, placed, adjacency, mirror, cost, seams,
                 uncuttable, options, context);
  return found;
}

namespace {

IndexPairs find_on_clean(const mesh::Surface& surface, const UnwrapOptions& options,
                         ExecutionContext& context) {
  const mesh::Adjacency& adjacency = surface.adjacency();
  const mesh::EdgeFlags seams = mesh::flag_edges(surface.faces, adjacency, options.cuts);
  const mesh::EdgeFlags uncuttable =
      options.uncuttable.rows() == 0
          ? mesh::EdgeFlags{}
          : mesh::flag_edges(surface.faces, adjacency, options.uncuttable);
  const mesh::Surface working{normalised(surface.vertices, surface.faces), surface.faces};
  UnwrapOptions own = options;
  own.seams.edges_only = true;
  own.acceptable = false;
  Stats ignored;
  const mesh::EdgeFlags cut =
      find_islands(working, surface.vertices, adjacency, seams, uncuttable, own, context, ignored)
          .islands.cut;
  return mesh::flagged_edges(surface.faces, adjacency, cut);
}

IndexPairs find_on_separated(const mesh::Surface& surface, const UnwrapOptions& options,
                             ExecutionContext& context) {
  const certify::SeparatedMap separated(surface, separating(options), context);
  const UnwrapOptions own = on_separated(separated, options);
  return separated.edges_of_input(
      separated.solve([&] { return find_on_clean(separated.surface(), own, context); }));
}

}  // namespace

IndexPairs find_seams(const mesh::Surface& surface, const UnwrapOptions& options,
                      ExecutionContext& context) {
  return in_time(context, options.max_seconds, "No seams were found", "or find them part by part",
                 [&] {
                   context.report("checking the mesh", 0.0);
                   const IndexPairs seams = certify::is_clean(surface, context)
                                                ? find_on_clean(surface, options, context)
                                                : find_on_separated(surface, options, context);
                   const Grace finishing(context);
                   context.report("done", 1.0);
                   return seams;
                 });
}

}  // namespace flipfree::unwrap
