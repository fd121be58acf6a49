#include "arrays.h"

namespace py = pybind11;

namespace flipfree::python {
namespace {

void add_transitions(py::dict& d, const std::vector<certify::Transition>& transitions) {
  std::vector<Index> turns;
  Points2 translations(static_cast<Eigen::Index>(transitions.size()), 2);
  for (const certify::Transition& t : transitions) {
    translations.row(static_cast<Eigen::Index>(turns.size())) = t.translation.transpose();
    turns.push_back(t.quarter_turns);
  }
  d["transition_turns"] = from_vector(turns);
  d["transition_translations"] = from_matrix(translations);
}

}  // namespace

const char* kind_name(ElementKind kind) {
  switch (kind) {
    case ElementKind::kNone:
      return "none";
    case ElementKind::kVertex:
      return "vertex";
    case ElementKind::kEdge:
      return "edge";
    case ElementKind::kFace:
      return "face";
    case ElementKind::kCorner:
      return "corner";
  }
  return "none";
}

py::dict to_dict(const certify::Certificate& c) {
  py::dict d;
  d["ok"] = c.ok;
  d["triangles"] = c.triangles;
  d["flips64"] = c.flips64;
  d["flips32"] = c.flips32;
  d["winding_failures"] = c.winding_failures;
  d["pin_failures"] = c.pin_failures;
  d["seam_failures"] = c.seam_failures;
  d["seam_edges"] = c.seam_edges;
  d["seams_exact64"] = c.seams_exact64;
  d["seams_exact32"] = c.seams_exact32;
  d["seam_deviation"] = c.seam_deviation;
  IndexPairs ends(static_cast<Eigen::Index>(c.seams.size()), 2);
  std::vector<certify::Transition> transitions;
  for (const certify::SeamTransition& seam : c.seams) {
    ends.row(static_cast<Eigen::Index>(transitions.size())) << seam.from, seam.to;
    transitions.push_back({seam.quarter_turns, seam.translation});
  }
  d["seam_vertices"] = from_matrix(ends);
  add_transitions(d, transitions);
  IndexPairs cones(static_cast<Eigen::Index>(c.quarter_cones.size()), 2);
  for (std::size_t i = 0; i < c.quarter_cones.size(); ++i) {
    cones.row(static_cast<Eigen::Index>(i)) << c.quarter_cones[i].first, c.quarter_cones[i].second;
  }
  d["quarter_cones"] = from_matrix(cones);
  d["cone_failures"] = c.cone_failures;
  d["holonomy_failures"] = c.holonomy_failures;
  d["provenance_failures"] = c.provenance_failures;
  d["overlaps"] = c.overlaps;
  d["island_overlaps"] = c.island_overlaps;
  d["island_overlap_faces"] = from_vector(c.island_overlap_faces);
  d["energy"] = c.energy;
  d["max_energy"] = c.max_energy;
  d["energy_p99"] = c.energy_p99;
  py::list mends;
  for (const mesh::Mend& mend : c.mends) {
    mends.append(py::make_tuple(std::string(describe(mend.kind)), kind_name(mend.element),
                                mend.count, from_vector(mend.elements)));
  }
  d["mends"] = mends;
  py::list failures;
  for (const std::string& failure : c.failures) failures.append(failure);
  d["failures"] = failures;
  d["failed_faces"] = from_vector(c.failed_faces);
  return d;
}

py::dict to_dict(const Stats& stats) {
  py::dict d;
  for (const auto& [name, value] : stats) {
    std::visit([&, &key = name](const auto& v) { d[py::str(key)] = py::cast(v); }, value);
  }
  return d;
}

py::dict to_dict(certify::Parametrization&& map) {
  py::dict d;
  const bool agreed = map.agreed.rows() == map.uv.rows();
  d["vertices"] = taken_matrix(std::move(map.surface.vertices));
  d["faces"] = taken_matrix(std::move(map.surface.faces));
  d["uv64"] = taken_matrix(std::move(map.uv)).attr("reshape")(-1, 3, 2);
  d["uv"] = agreed ? taken_matrix(std::move(map.agreed)).attr("reshape")(-1, 3, 2)
                   : py::object(d["uv64"]);
  d["uv32"] = taken_matrix(std::move(map.uv32)).attr("reshape")(-1, 3, 2);
  d["parent_face"] = taken_vector(std::move(map.parent_face));
  d["vertex_parent"] = taken_vector(std::move(map.vertex_parent));
  d["vertex_barycentric"] = taken_matrix(std::move(map.vertex_barycentric));
  d["cut_edges"] = taken_matrix(std::move(map.cut_edges));
  add_transitions(d, map.transitions);
  d["certificate"] = to_dict(map.certificate);
  d["stats"] = to_dict(map.stats);
  return d;
}

std::vector<certify::CornerPin> to_corner_pins(const Array<Index>& corners,
                                               const Array<double>& uv) {
  const Points2 targets = to_matrix<Points2>(uv, "pin_uv");
  if (corners.size() != targets.rows()) {
    throw_invalid(ErrorCode::kBadShape, "Pins need one target per corner.");
  }
  std::vector<certify::CornerPin> pins;
  for (py::ssize_t i = 0; i < corners.size(); ++i)
    pins.push_back({corners.data()[i], targets.row(i).transpose()});
  return pins;
}

mesh::Surface to_surface(const Array<double>& vertices, const Array<Index>& faces) {
  return {to_matrix<Points3>(vertices, "vertices"), to_matrix<Triangles>(faces, "faces")};
}

std::optional<std::vector<intrinsic::LoopTurn>> to_loops(const py::object& given) {
  if (given.is_none()) return std::nullopt;
  std::vector<intrinsic::LoopTurn> loops;
  for (const py::handle item : given) {
    const auto pair = item.cast<std::pair<Array<Index>, Index>>();
    loops.push_back({{pair.first.data(), pair.first.data() + pair.first.size()}, pair.second});
  }
  return loops;
}

py::list from_loops(const std::vector<intrinsic::LoopTurn>& loops) {
  py::list list;
  for (const intrinsic::LoopTurn& loop : loops)
    list.append(py::make_tuple(from_vector(loop.loop), loop.quarter_turns));
  return list;
}

}  // namespace flipfree::python
