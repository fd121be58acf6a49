#include "flipfree/unwrap/chart/chart_pins.h"

#include <algorithm>
#include <map>
#include <optional>
#include <string>

#include "flipfree/base/error.h"

namespace flipfree::unwrap {

std::vector<char> pinned_vertices(const mesh::Surface& surface,
                                  const std::vector<certify::CornerPin>& pins) {
  if (pins.empty()) return {};
  std::vector<char> pinned(static_cast<std::size_t>(surface.vertices.rows()), 0);
  for (const certify::CornerPin& pin : pins) {
    if (pin.corner >= 0 && pin.corner < surface.faces.size())
      pinned[static_cast<std::size_t>(surface.faces(pin.corner / 3, pin.corner % 3))] = 1;
  }
  return pinned;
}

namespace {

// Added cuts avoid pinned vertices; where they could not, one vertex has two places in its chart,
// and its pin would have to be met by both.
void refuse_pins_on_added_cuts(const Islands& islands, const ChartPins& pins) {
  const Triangles& faces = islands.mesh.faces;
  std::vector<char> on_added(islands.mesh.vertex_origin.size(), 0);
  for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(islands.added.size()); ++h) {
    if (islands.added[static_cast<std::size_t>(h)] == 0) continue;
    on_added[static_cast<std::size_t>(mesh::source(faces, h))] = 1;
    on_added[static_cast<std::size_t>(mesh::target(faces, h))] = 1;
  }
  for (std::size_t c = 0; c < pins.of_chart.size(); ++c) {
    std::map<VertexId, Vector2> known;
    for (const auto& [local, uv] : pins.of_chart[c]) {
      const VertexId v = islands.charts[c].vertices[static_cast<std::size_t>(local)];
      const VertexId origin = islands.mesh.vertex_origin[static_cast<std::size_t>(v)];
      const auto [it, fresh] = known.emplace(origin, uv);
      if (fresh || it->second != uv || on_added[static_cast<std::size_t>(v)] == 0) continue;
      throw_not_converged(
          ErrorCode::kBadPins,
          "The island of vertex " + std::to_string(origin) +
              " had to be cut open, and every way that was found runs through this pinned vertex, "
              "which has two places then. Mark seams that open the island elsewhere, or unpin "
              "some vertices.",
          ElementKind::kVertex, {origin});
    }
  }
}

}  // namespace

ChartPins pins_by_chart(const Islands& islands, const std::vector<certify::CornerPin>& pins) {
  ChartPins result;
  result.of_chart.resize(islands.charts.size());
  if (pins.empty()) return result;
  const std::size_t cut_vertices = islands.mesh.vertex_origin.size();
  std::vector<std::pair<std::size_t, VertexId>> place(cut_vertices);
  for (std::size_t c = 0; c < islands.charts.size(); ++c) {
    for (std::size_t i = 0; i < islands.charts[c].vertices.size(); ++i) {
      place[static_cast<std::size_t>(islands.charts[c].vertices[i])] = {c,
                                                                        static_cast<VertexId>(i)};
    }
  }
  std::vector<std::optional<Vector2>> target(cut_vertices);
  certify::require_storable_pins(pins, static_cast<Index>(islands.mesh.faces.size()));
  for (const certify::CornerPin& pin : pins) {
    const auto v = static_cast<std::size_t>(islands.mesh.faces(pin.corner / 3, pin.corner % 3));
    if (target[v]) {
      if (*target[v] == pin.uv) continue;
      const VertexId origin = islands.mesh.vertex_origin[v];
      throw_invalid(ErrorCode::kBadPins,
                    "Vertex " + std::to_string(origin) +
                        " is pinned to two different places within one chart. Mark a seam between "
                        "them or unpin one.",
                    ElementKind::kVertex, {origin});
    }
    target[v] = pin.uv;
    const auto [chart, local] = place[v];
    result.of_chart[chart].emplace_back(local, pin.uv);
  }
  refuse_pins_on_added_cuts(islands, result);
  return result;
}

}  // namespace flipfree::unwrap
