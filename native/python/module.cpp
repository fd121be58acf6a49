// The compiled module flipfree._native: thin, boring, no logic.
#include <algorithm>
#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <tuple>
#include <utility>
#include <vector>

#include "bindings.h"
#include "flipfree/certify/certified_map.h"
#include "flipfree/certify/separated_map.h"
#include "flipfree/conformal/boundary_angles.h"
#include "flipfree/conformal/suggest_cones.h"
#include "flipfree/embedding/embed_surface.h"
#include "flipfree/holonomy/field_aligned.h"
#include "flipfree/holonomy/needed_topology.h"
#include "flipfree/matchmaker/match.h"
#include "flipfree/mesh/files/mesh_file.h"
#include "flipfree/mesh/islands.h"
#include "flipfree/mesh/separated/edge_pairs.h"
#include "flipfree/mesh/validate.h"
#include "flipfree/quads/box_tree.h"
#include "flipfree/quads/tiles.h"
#include "flipfree/seamless/exact/seamless_map.h"
#include "flipfree/seamless/padding/padding.h"
#include "flipfree/seamless/request.h"
#include "flipfree/unwrap/islands/grids.h"
#include "flipfree/unwrap/packing/pack.h"
#include "flipfree/unwrap/repair/improve.h"
#include "flipfree/unwrap/repair/repair.h"
#include "flipfree/unwrap/seams/auto_islands.h"
#include "flipfree/unwrap/unwrap.h"

namespace flipfree::python {

template <>
constexpr std::array kWords<embedding::BoundaryShape>{"circle", "square", "triangle"};
template <>
constexpr std::array kWords<embedding::EmbedMethod>{"ladder", "progressive", "tutte"};
template <>
constexpr std::array kWords<matchmaker::MatchEngine>{"auto", "first try", "outline", "arms",
                                                     "matchmaker"};
template <>
constexpr std::array kWords<unwrap::SelfOverlaps>{"cut", "open", "keep"};
template <>
constexpr std::array kWords<unwrap::StretchedIslands>{"", "keep", "improve"};
template <>
constexpr std::array kWords<unwrap::Rotation>{"none", "quarters", "straight", "free"};
template <>
constexpr std::array kWords<conformal::BoundaryGoal>{"free", "straight", "circle"};
template <>
constexpr std::array kWords<intrinsic::Refinement>{"auto", "never", "full"};
template <>
constexpr std::array kWords<seamless::Engine>{"auto", "penner", "padding"};
template <>
constexpr std::array kWords<seamless::Boundary>{"aligned", "aligned_or_free", "free"};

namespace {

using field::GivenField;
using Cones = std::optional<std::vector<Index>>;
using Ids = std::vector<Index>;

// Raises flipfree.errors.<name>.
void raise(const char* name, const Error& error, const py::object& certificate = py::none()) {
  const py::object type = py::module_::import("flipfree.errors").attr(name);
  const py::object instance = type(py::arg("certificate") = certificate, **to_python(error));
  PyErr_SetObject(type.ptr(), instance.ptr());
}

void translate(std::exception_ptr failure) {
  try {
    if (failure) std::rethrow_exception(failure);
  } catch (const InvalidInput& e) {
    raise("InvalidInput", e.error());
  } catch (const Infeasible& e) {
    raise("Infeasible", e.error());
  } catch (const certify::CertificateFailed& e) {
    const py::object make = py::module_::import("flipfree.results").attr("certificate_from");
    raise("NotConverged", e.error(), make(to_python(e.certificate())));
  } catch (const Cancelled& e) {
    raise("Cancelled", e.error());
  } catch (const Exception& e) {
    raise("NotConverged", e.error());
  }
}

// Meshes, files and certificates.

auto split_fans(const Triangles& faces, const IndexPairs& cuts) {
  mesh::CutMesh fans = mesh::split_fans(faces, cuts);
  return std::tuple(std::move(fans.faces), std::move(fans.vertex_origin));
}

auto islands(const Triangles& faces, const std::optional<Points2f>& corner_uv) {
  mesh::Islands found = mesh::islands_of(faces, corner_uv ? &*corner_uv : nullptr);
  return std::tuple(std::move(found.first), found.nearly_joined);
}

auto separate(const Points3& vertices, const Triangles& faces, const IndexPairs& seams,
              const std::vector<Index>& materials, const std::vector<Index>& polygons) {
  mesh::SeparateOptions options;
  options.seams = &seams;
  if (!materials.empty()) options.material = &materials;
  if (!polygons.empty()) options.polygon = &polygons;
  mesh::SeparatedSurface found = mesh::separate({vertices, faces}, options, ExecutionContext());
  return std::tuple(mesh::rest_positions(found.surface), found.surface.faces.triangles(),
                    std::move(found.vertex_origin), std::move(found.face_origin),
                    std::vector<Index>(found.turned.begin(), found.turned.end()),
                    std::move(found.collapsed), std::move(found.mends));
}

auto read_mesh(const std::string& path, std::string_view content) {
  mesh::MeshFile file = mesh::read_mesh(content, mesh::format_of(path));
  return std::tuple(std::move(file.vertices), std::move(file.faces), std::move(file.polygons),
                    std::move(file.corners), std::move(file.uv));
}

py::bytes write_mesh(const std::string& path, const Points3& vertices, const Triangles& faces,
                     const std::vector<Index>& polygons, const Triangles& corners,
                     const Points2f& uv) {
  const std::string content =
      mesh::write_mesh({vertices, faces, polygons, corners, uv}, mesh::format_of(path));
  const py::gil_scoped_acquire acquire;
  return py::bytes(content);
}

// The input's vertices and faces, and where the map's faces and vertices lie in it.
using Parent = std::tuple<Points3, Triangles, Ids, Ids, Points3>;

certify::CertifyRequest read_certify(OptionReader& read) {
  certify::CertifyRequest request;
  FLIPFREE_EACH(read, request, mirrored, find_mirrored, pins, aspect, features, cone_angles,
                require_seamless)
  request.require_cones = read("loops", request.loops);
  read("bijective", request.require_bijective);
  read("disjoint", request.require_disjoint);
  return request;
}

certify::Certificate certify_map(const mesh::Surface& surface, const Points2& uv,
                                 const std::optional<Parent>& parent,
                                 certify::CertifyRequest request, ExecutionContext& context) {
  const Points2f stored = uv.cast<float>();
  if (!parent) {
    request.surface = &surface;
    request.uv = &uv;
    request.uv32 = &stored;
    return certify::certify_any(request, context);
  }
  mesh::validate(surface, {.reject_zero_area = false}, context);
  certify::Parametrization map;
  map.surface = surface;
  map.uv = uv;
  map.uv32 = stored;
  mesh::Surface input;
  std::tie(input.vertices, input.faces, map.parent_face, map.vertex_parent,
           map.vertex_barycentric) = *parent;
  certify::certify_map(map, input, request, context);
  return map.certificate;
}

// Maps.

matchmaker::MatchRequest read_request(OptionReader& read) {
  using matchmaker::Polygon;
  matchmaker::MatchRequest request;
  const auto [pinned, targets] = read.value<std::pair<Ids, Polygon>>("points");
  for (std::size_t i = 0; i < pinned.size(); ++i) request.points.push_back({pinned[i], targets[i]});
  for (auto& [vertices, polyline] : read.value<std::vector<std::pair<Ids, Polygon>>>("lines"))
    request.lines.push_back({vertices, polyline});
  FLIPFREE_EACH(read, request, boundary_loop, boundary_uv, paths, movable)
  return request;
}

conformal::ConformalMapOptions read_map(OptionReader& read) {
  conformal::ConformalMapOptions options;
  FLIPFREE_EACH(read, options, cuts, uncuttable, refinement)
  FLIPFREE_EACH(read, options.metric, tolerance, bits, max_seconds, require_convergence,
                max_iterations)
  read("intrinsic_refinement", options.refined_start);
  return options;
}

template <typename Options>
Options read_seamless(OptionReader& read) {
  Options options;
  FLIPFREE_EACH(read, options, boundary, optimise, exact, max_seconds)
  read("engine", options.which);
  read("uncuttable", options.engine.uncuttable);
  read("max_iterations", options.engine.max_iterations);
  if constexpr (std::is_same_v<Options, seamless::SeamlessOptions>) {
    options.max_iterations = options.engine.max_iterations;
  } else {
    FLIPFREE_EACH(read, options, sizing, features, reroute)
  }
  return options;
}

field::FieldOptions read_field(OptionReader& read) {
  field::FieldOptions options;
  FLIPFREE_EACH(read, options, alignment, edges, let_go, boundary, edge_weight, simplify, sizing,
                cones, loops, max_seconds)
  return options;
}

// A map as it is stored.
certify::Parametrization map_of(const mesh::Surface& surface, const Points2f& uv) {
  certify::Parametrization map;
  map.surface = surface;
  map.uv32 = uv;
  certify::set_identity_provenance(map);
  return map;
}

// The faces that are nearest to points, and the weights there.
auto nearest(const Points3& vertices, const Triangles& faces, const Points3& points) {
  std::vector<std::array<Vector3, 3>> triangles;
  for (const auto& face : faces.rowwise())
    triangles.push_back({vertices.row(face[0]), vertices.row(face[1]), vertices.row(face[2])});
  const quads::BoxTree tree(std::move(triangles));
  std::vector<FaceId> parents;
  Points3 weights(points.rows(), 3);
  for (Eigen::Index i = 0; i < points.rows(); ++i) {
    const quads::BoxTree::Nearest found = tree.nearest(points.row(i).transpose());
    parents.push_back(static_cast<FaceId>(found.triangle));
    weights.row(i) = found.weights.transpose();
  }
  return std::tuple(std::move(parents), std::move(weights));
}

// Any map of its own triangles, judged.
certify::Parametrization judged(const mesh::Surface& surface, const Points2& uv,
                                ExecutionContext& context) {
  certify::Certificate certificate = certify_map(surface, uv, std::nullopt, {}, context);
  certify::Parametrization map = map_of(surface, uv.cast<float>());
  map.uv = uv;
  map.certificate = std::move(certificate);
  return map;
}

certify::Parametrization follow(const mesh::Surface& surface,
                                const std::optional<GivenField>& given,
                                const field::FieldOptions& made,
                                const holonomy::AlignedOptions& options,
                                ExecutionContext& context) {
  const auto find = [&] {
    if (!given) return holonomy::compute_map_along_features(surface, made, options, context);
    return holonomy::compute_field_aligned_map(surface, field::read_field(surface, *given, context),
                                               options, context);
  };
  return in_time(context, options.max_seconds, "The field-aligned map was not reached",
                 "or simplify the field", find);
}

void require_closed(const std::vector<HalfedgeId>& opposite) {
  const auto open = std::ranges::find(opposite, kInvalid) - opposite.begin();
  if (open == std::ssize(opposite)) return;
  const auto face = static_cast<FaceId>(open / 3);
  throw_invalid(ErrorCode::kBadOption,
                "The surface is open at face " + face_id(face) +
                    ", and admissible cuts are of closed ones. Close its holes.",
                ElementKind::kFace, {face});
}

using Sectors = std::vector<std::pair<VertexId, FaceId>>;

// (refined surface, its parent faces, parents and weights of its vertices, branches as vertices,
// (vertex, first face) of each right angle at a node and of each flat sector there, stats).
auto described(holonomy::RefinedPieces&& pieces, Stats stats) {
  const Triangles& faces = pieces.surface.faces;
  std::vector<Ids> branches;
  Sectors corners, flat;
  FaceId first = 0;
  for (const seamless::AdmissibleCut& cut : pieces.cuts) {
    const auto placed = [&](HalfedgeId h) {
      return std::pair{mesh::source(faces, h + 3 * first), h / 3 + first};
    };
    const mesh::Adjacency& adjacency = cut.surface.adjacency();
    for (const HalfedgeId h : cut.flat_sectors) flat.push_back(placed(h));
    for (const Ids& branch : cut.branches) {
      Ids& path = branches.emplace_back();
      for (const HalfedgeId h : branch) path.push_back(placed(h).first);
      path.push_back(mesh::target(faces, branch.back() + 3 * first));
      // Both ends are nodes, at each of which the sector to the left of the branch begins.
      const HalfedgeId back = adjacency.opposite[static_cast<std::size_t>(branch.back())];
      for (const HalfedgeId h : {branch.front(), back}) {
        if (std::ranges::find(cut.flat_sectors, h) == cut.flat_sectors.end())
          corners.push_back(placed(h));
      }
    }
    first += static_cast<FaceId>(cut.surface.faces.rows());
  }
  auto [parents, weights] = places_of(pieces.provenance.vertex);
  return std::tuple(std::move(pieces.surface.vertices), pieces.surface.faces.triangles(),
                    std::move(pieces.provenance.face), std::move(parents), std::move(weights),
                    std::move(branches), std::move(corners), std::move(flat), std::move(stats));
}

// With the cones given, or with those of a field and turning as it does (thesis 5.2.1, 6.5).
auto admissible_cut(const mesh::Surface& surface, const Cones& cones,
                    const std::optional<GivenField>& given, bool reroute,
                    ExecutionContext& context) {
  mesh::validate(surface, {}, context);
  require_closed(surface.adjacency().opposite);
  std::optional<field::CrossField> own;
  if (given) {
    own = field::read_field(surface, *given, context);
  } else {
    seamless::check_request(surface, *cones, context);
  }
  const Ids wanted =
      own ? holonomy::needed_topology(surface, *own, true, 0.0, context).cones : *cones;
  seamless::Reroutings done;
  holonomy::RefinedPieces pieces =
      holonomy::field_cut(surface, own && reroute ? &*own : nullptr, wanted, done, context);
  if (!own) return described(std::move(pieces), {});
  return described(std::move(pieces), {{"loops", static_cast<std::int64_t>(done.loops)},
                                       {"guided", static_cast<std::int64_t>(done.shortest)},
                                       {"fallback", static_cast<std::int64_t>(done.fallback)},
                                       {"quarters", static_cast<std::int64_t>(done.quarters)}});
}

auto read_any_field(const Points3& vertices, const Triangles& faces, const GivenField& given) {
  const mesh::Surface surface{vertices, faces};
  return field::describe(surface, field::read_field(surface, given, ExecutionContext()));
}

}  // namespace
}  // namespace flipfree::python

PYBIND11_MODULE(_native, module) {
  using namespace flipfree;
  using namespace flipfree::python;
  module.doc() = "Compiled solver of Flipfree UV; use the package `flipfree`, not this module.";
  module.attr("version") = FLIPFREE_VERSION;
  py::register_exception_translator(&translate);
  py::class_<Job>(module, "Job")
      .def("wait", &Job::wait)
      .def("cancel", &Job::cancel)
      .def("accept", &Job::accept)
      .def("progress", &Job::progress)
      .def("result", &Job::result);

  const py::call_guard<py::gil_scoped_release> without_gil;
  module.def("split_fans", &split_fans, without_gil);
  module.def("islands", &islands, without_gil);
  module.def("separate", &separate, without_gil);
  module.def("read_mesh", &read_mesh, without_gil);
  module.def("write_mesh", &write_mesh, without_gil);
  module.def("nearest", &nearest, without_gil);
  module.def("read_field", &read_any_field, without_gil);

  const auto uv = option<Points2>("uv");
  const auto uv32 = option<Points2f>("uv32");
  const auto cones = option<Cones>("cones");
  const auto given_field = option<std::optional<GivenField>>("field");
  def_job(module, "certify", "The map was not judged", "or certify fewer faces at once",
          prepared(&certify_map, uv, option<std::optional<Parent>>("parent"), read_certify));
  def_job(module, "judged", "The maps were not judged", "or compose maps of fewer faces",
          prepared(&judged, uv));

  // Disks, and whatever has a boundary.
  def_job(module, "embed",
          prepared(&embedding::embed_surface,
                   FLIPFREE_READER(embedding::EmbedSurfaceOptions, shape, polygon, loop, initial,
                                   start_from_tutte, method, optimise, tolerance, max_iterations,
                                   max_seconds)));
  def_job(module, "match",
          prepared(&matchmaker::match, read_request,
                   FLIPFREE_READER(matchmaker::MatchOptions, engine, optimise, bijective,
                                   max_iterations, max_seconds)));

  // Any triangles.
  const auto read_unwrap = FLIPFREE_READER(
      unwrap::UnwrapOptions, cuts, uncuttable, pins, bijective, may_add_cuts, cut_extremities,
      tolerance, margin, effort, max_seconds, material, polygon, seams.find, seams.stretch,
      seams.sharp_angle, seams.weighted, seams.weights, max_iterations, place_like);
  def_job(module, "unwrap", prepared(&unwrap::unwrap, read_unwrap));
  def_job(module, "auto_seams", prepared(&unwrap::find_seams, read_unwrap));
  def_job(module, "rectify", "The islands were not straightened",
          "or straighten fewer faces at once",
          prepared(&unwrap::rectify,
                   FLIPFREE_READER(unwrap::RectifyOptions, corner_uv, polygon, cuts)));
  const auto improve = [](const auto& surface, const Points2& corner_uv, bool repair,
                          const auto& options, auto& context) {
    return repair ? unwrap::improve_any(surface, corner_uv, options, context)
                  : unwrap::improve(surface, corner_uv, options, context);
  };
  def_job(module, "improve",
          prepared(improve, uv, option<bool>("repair"),
                   FLIPFREE_READER(unwrap::ImproveOptions, pins, keep_bijective, tolerance, aspect,
                                   max_iterations, max_seconds)));
  def_job(
      module, "repair",
      prepared(&unwrap::repair, uv,
               FLIPFREE_READER(unwrap::RepairOptions, cuts, uncuttable, pins, overlaps, stretched,
                               disjoint, margin, tolerance, aspect, max_iterations, max_seconds)));
  def_job(module, "pack", "The charts were not packed", "or pack fewer faces at once",
          prepared(&unwrap::pack, uv,
                   FLIPFREE_READER(unwrap::PackOptions, margin, rotation, together, scale_true,
                                   keep_bijective, unmoved, obstacles, groups, layouts, share_tile,
                                   stack, stack_mirrored, effort, first_tile, tiles, density,
                                   place_like)));

  // Conformal metrics and maps, and the angles for them.
  const auto lengths = option<std::optional<Points3>>("lengths");
  const auto angles = option<std::vector<double>>("target_angles");
  const auto metric = [](const auto& surface, const auto& own, const auto& target,
                         const auto& options, auto& context) {
    return conformal::compute_refined_metric(surface, own ? &*own : nullptr, target, options.metric,
                                             options.refined_start, context)
        .metric;
  };
  def_job(module, "conformal_metric", prepared(metric, lengths, angles, read_map));
  const auto map = [](const auto& surface, const auto& own, const auto& target, const auto& options,
                      auto& context) {
    return conformal::conformal_map(surface, own ? &*own : nullptr, target, options, context);
  };
  def_job(module, "conformal", prepared(map, lengths, angles, read_map));
  const auto suggest = [](const auto& surface, const auto& options, auto& context) {
    const conformal::SuggestedCones found = conformal::suggest_cones(surface, options, context);
    return std::tuple(found.target_angles, found.cones, found.scale_ratio, found.bound_holds);
  };
  def_job(module, "suggest_cones",
          prepared(suggest, FLIPFREE_READER(conformal::SuggestConesOptions, bound, max_cones,
                                            quantum, least_angle, max_seconds)));
  def_job(module, "boundary_angles",
          prepared(&conformal::boundary_angles,
                   FLIPFREE_READER(conformal::BoundaryAnglesOptions, boundary, cones, corners,
                                   max_seconds)));

  // Seamless maps, cross fields, and maps that follow them.
  const auto seamless_map = [](const auto& surface, const Cones& given, const auto& options,
                               auto& context) {
    return given ? seamless::compute_seamless_map(surface, *given, options, context)
                 : seamless::map_with_suggested_cones(surface, options, context);
  };
  def_job(module, "seamless",
          prepared(seamless_map, cones, read_seamless<seamless::SeamlessOptions>));
  const auto read_made = [](OptionReader& read) {
    OptionReader made(read.value<py::dict>("made"));
    const field::FieldOptions options = read_field(made);
    made.end();
    return options;
  };
  def_job(module, "field_aligned",
          prepared(&follow, given_field, read_made, read_seamless<holonomy::AlignedOptions>));
  def_job(module, "admissible_cut", "The cut was not found", "or ask for fewer cones",
          prepared(&admissible_cut, cones, given_field, option<bool>("reroute")));
  const auto make_field = [](const auto& surface, const auto& options, auto& context) {
    field::FoundField found = field::compute_cross_field(surface, options, context);
    return std::tuple(field::describe(surface, found.field), std::move(found.stats));
  };
  def_job(module, "cross_field", prepared(make_field, read_field));
  const auto signature_of = [](const auto& surface, const GivenField& given, auto& context) {
    const field::Signature found =
        field::signature_of(surface, field::read_field(surface, given, context), context);
    return std::tuple(found.cones, found.loops);
  };
  def_job(module, "field_signature", "The signature was not reached",
          "or ask for that of fewer faces", prepared(signature_of, option<GivenField>("field")));

  // Quads from a surface, and from a map; maps for textures that repeat.
  const auto read_quads = FLIPFREE_READER(quads::QuadOptions, target, edge_length, features, sizing,
                                          adaptive, with_map);
  const char* const missing = "The quads were not reached";
  def_job(module, "quads", missing, "or ask for fewer quads",
          prepared(&quads::quads_of_surface, given_field, read_quads));
  const auto judge = [](const auto& surface, const Points3& vertices, const Ids& corners,
                        const Ids& parent_face, const Points3& barycentric, const Ids& quad_parent,
                        auto& context) {
    quads::QuadArrays mesh{vertices, {}, parent_face, barycentric, quad_parent};
    for (std::size_t i = 0; i + 3 < corners.size(); i += 4)
      mesh.quads.push_back({corners[i], corners[i + 1], corners[i + 2], corners[i + 3]});
    return quads::certify_quads(surface, mesh, nullptr, -1, context);
  };
  def_job(
      module, "certify_quads", "The quads were not judged", "or ask for fewer quads",
      prepared(judge, option<Points3>("vertices"), option<Ids>("quads"), option<Ids>("parent_face"),
               option<Points3>("barycentric"), option<Ids>("quad_parent")));
  const auto of_map = [](const auto& surface, const Points2f& stored, auto& context) {
    return quads::quads_of_map(map_of(surface, stored), surface, {}, context);
  };
  def_job(module, "quads_from_map", missing, "or take a map of fewer cells",
          prepared(of_map, uv32));
  const auto fit = [](const auto& surface, const Points2f& stored, const auto& options,
                      auto& context) {
    return quads::fit_tiles(map_of(surface, stored), options, context);
  };
  def_job(module, "fit_tiles",
          prepared(fit, uv32,
                   FLIPFREE_READER(quads::TileOptions, tile, prefer_translations, features,
                                   max_seconds)));
}
