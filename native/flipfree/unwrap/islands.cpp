#include "flipfree/unwrap/islands.h"

#include "flipfree/base/error.h"
#include "flipfree/mesh/cut_graph.h"
#include "flipfree/mesh/topology.h"

namespace flipfree {

Islands make_islands(const Surface& surface, const Adjacency& adjacency, const EdgeFlags& seams,
                     const EdgeFlags& uncuttable, ExecutionContext& context) {
  Islands islands;
  islands.cut = seams;
  islands.added.assign(seams.size(), 0);
  // One round opens every piece; cutting through a hole can in rare cases split a piece in two, and
  // seams around a handle can leave a part that needs another. Each round lowers the genus or opens
  // a closed piece.
  constexpr int kMostRounds = 64;
  for (int round = 0; round < kMostRounds; ++round) {
    islands.mesh = cut_along(surface.faces, adjacency, islands.cut);
    islands.charts = split_into_charts(surface.vertices, islands.mesh);
    bool planar = true;
    for (const Chart& chart : islands.charts) {
      context.check();
      const Adjacency local =
          build_adjacency(static_cast<Index>(chart.surface.vertices.rows()), chart.surface.faces);
      EdgeFlags local_uncuttable(uncuttable.empty() ? 0 : local.opposite.size());
      for (std::size_t h = 0; h < local_uncuttable.size(); ++h) {
        local_uncuttable[h] = uncuttable[3 * static_cast<std::size_t>(chart.faces[h / 3]) + h % 3];
      }
      const EdgeFlags graph = planar_cut(chart.surface, local, context, local_uncuttable);
      bool opened = false;
      for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(graph.size()); ++h) {
        if (!graph[static_cast<std::size_t>(h)]) continue;
        opened = true;
        const HalfedgeId global = 3 * chart.faces[static_cast<std::size_t>(h / 3)] + h % 3;
        islands.cut[static_cast<std::size_t>(global)] = 1;
        islands.added[static_cast<std::size_t>(global)] = 1;
      }
      if (!opened) continue;
      planar = false;
      if (round == 0) ++islands.opened;
    }
    if (planar) return islands;
  }
  throw InternalError("a chart could not be cut open; please report this mesh");
}

}  // namespace flipfree
