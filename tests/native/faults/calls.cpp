#include "faults/calls.h"

#include <cctype>
#include <cmath>
#include <utility>

#include "flipfree/base/failure.h"
#include "flipfree/certify/certified_map.h"
#include "flipfree/certify/certify.h"
#include "flipfree/embedding/embed_surface.h"
#include "flipfree/matchmaker/match.h"
#include "flipfree/mesh/adjacency.h"
#include "flipfree/mesh/validate.h"
#include "flipfree/unwrap/packing/pack.h"
#include "flipfree/unwrap/repair/improve.h"
#include "flipfree/unwrap/unwrap.h"
#include "support/shapes.h"

namespace flipfree::test {
namespace {

using Solve = std::function<certify::Parametrization(ExecutionContext&, double max_seconds)>;

Call map_call(std::string name, mesh::Surface input, Solve solve) {
  return {std::move(name), [input = std::move(input), solve = std::move(solve)](
                               ExecutionContext& context, double max_seconds) {
            return bytes_of_valid(solve(context, max_seconds), input);
          }};
}

std::vector<VertexId> boundary_of(const mesh::Surface& surface) {
  return mesh::boundary_loops(surface.faces, surface.adjacency()).front();
}

// Corner UVs of a plane surface: its own places, sheared.
Points2 sheared(const mesh::Surface& surface) {
  Points2 uv(surface.faces.size(), 2);
  for (Index c = 0; c < uv.rows(); ++c) {
    const Vector3 p = surface.vertices.row(surface.faces.data()[c]);
    uv.row(c) << p.x() + 3 * p.y(), p.y();
  }
  return uv;
}

// Packing that searches for long allocates the same again and again.
constexpr double kLittleEffort = 0.02;

Call unwrap_call(std::string name, const mesh::Surface& surface,
                 const unwrap::UnwrapOptions& options) {
  return map_call(std::move(name), surface, [=](ExecutionContext& context, double max_seconds) {
    unwrap::UnwrapOptions limited = options;
    limited.effort = kLittleEffort;
    limited.max_seconds = max_seconds;
    return unwrap::unwrap(surface, limited, context);
  });
}

Call embed_call(std::string name, const mesh::Surface& surface,
                const embedding::EmbedSurfaceOptions& options) {
  return map_call(std::move(name), surface, [=](ExecutionContext& context, double max_seconds) {
    embedding::EmbedSurfaceOptions limited = options;
    limited.max_seconds = max_seconds;
    return embedding::embed_surface(surface, limited, context);
  });
}

Call match_call(std::string name, const mesh::Surface& surface,
                const matchmaker::MatchRequest& request, const matchmaker::MatchOptions& options) {
  Call call =
      map_call(std::move(name), surface, [=](ExecutionContext& context, double max_seconds) {
        matchmaker::MatchOptions limited = options;
        limited.max_seconds = max_seconds;
        return matchmaker::match(surface, request, limited, context);
      });
  call.may_lose_blocks = 1;
  return call;
}

void add_unwraps(std::vector<Call>& calls) {
  const mesh::Surface bumps = bumpy_grid(5, 4, 0.4, 3);
  calls.push_back(unwrap_call("unwrap", bumps, {}));
  calls.push_back(unwrap_call("unwrap, closed", beside(sphere(8, 5), torus(6, 5)), {}));
  unwrap::UnwrapOptions pinned;
  pinned.pins = {{0, Vector2(0.25, 0.5)}, {31, Vector2(0.75, 0.625)}};
  calls.push_back(unwrap_call("unwrap, pins", bumps, pinned));
}

void add_layouts(std::vector<Call>& calls) {
  const mesh::Surface plane = beside(grid(4, 3), grid(3, 3));
  const Points2 uv = sheared(plane);
  calls.push_back(map_call("improve", plane, [=](ExecutionContext& context, double max_seconds) {
    unwrap::ImproveOptions options;
    options.max_seconds = max_seconds;
    return unwrap::improve(plane, uv, options, context);
  }));
  calls.push_back(map_call("pack", plane, [=](ExecutionContext& context, double max_seconds) {
    unwrap::PackOptions options;
    options.effort = kLittleEffort;
    options.scale_true = true;
    return in_time(context, max_seconds, "Packing did not end", "or pack less",
                   [&] { return unwrap::pack(plane, uv, options, context); });
  }));
  calls.push_back({"certify", [=](ExecutionContext& context, double max_seconds) {
                     const Points2f stored = uv.cast<float>();
                     certify::CertifyRequest request;
                     request.surface = &plane;
                     request.uv = &uv;
                     request.uv32 = &stored;
                     const certify::Certificate certificate = in_time(
                         context, max_seconds, "The map was not judged", "or judge less", [&] {
                           mesh::validate(plane, {}, context);
                           return certify::certify(request, context);
                         });
                     if (!certificate.ok) throw WrongResult("a valid map is not certified");
                     std::string bytes;
                     append(bytes, &certificate.energy, 1);
                     append(bytes, &certificate.overlaps, 1);
                     append(bytes, &certificate.island_overlaps, 1);
                     return bytes;
                   }});
}

void add_embeddings(std::vector<Call>& calls) {
  const mesh::Surface bumps = bumpy_grid(5, 4, 0.4, 3);
  calls.push_back(embed_call("embed", bumps, {}));
  embedding::EmbedSurfaceOptions square;
  square.shape = embedding::BoundaryShape::kSquare;
  square.optimise = true;
  calls.push_back(embed_call("embed, optimised", bumps, square));
  calls.push_back(embed_call("embed, deep", stacked(60, Stacking::kDeep), {}));
  embedding::EmbedSurfaceOptions progressive;
  progressive.method = embedding::EmbedMethod::kProgressive;
  progressive.initial = Points2(sphere(6, 4).vertices.leftCols<2>());
  mesh::Surface opened = sphere(6, 4);
  opened.faces = Triangles(opened.faces.triangles().topRows(opened.faces.rows() - 1));
  calls.push_back(embed_call("embed, progressive", opened, progressive));
}

void add_matches(std::vector<Call>& calls) {
  const mesh::Surface bumps = bumpy_grid(5, 4, 0.3, 3);
  matchmaker::MatchRequest pins;
  pins.points = {
      {0, Vector2(0, 0)}, {29, Vector2(1, 1)}, {8, Vector2(0.7, 0.6)}, {15, Vector2(0.3, 0.4)}};
  calls.push_back(match_call("match", bumps, pins, {}));
  matchmaker::MatchOptions one_to_one;
  one_to_one.bijective = true;
  calls.push_back(match_call("match, bijective", bumps, pins, one_to_one));
  matchmaker::MatchOptions proven;
  proven.engine = matchmaker::MatchEngine::kMatchmaker;
  calls.push_back(match_call("match, MatchMaker", bumps, pins, proven));
  matchmaker::MatchOptions armed;
  armed.engine = matchmaker::MatchEngine::kArms;
  calls.push_back(match_call("match, arms", bumps, pins, armed));

  matchmaker::MatchRequest round = pins;
  round.points = {{8, Vector2(0.3, 0.1)}, {15, Vector2(-0.3, -0.1)}};
  round.boundary_loop = boundary_of(bumps);
  for (const VertexId v : round.boundary_loop) {
    const Vector2 p = bumps.vertices.row(v).head<2>().transpose() - Vector2(0.5, 0.5);
    round.boundary_uv.emplace_back(p.normalized());
  }
  calls.push_back(match_call("match, boundary", bumps, round, {}));
  round.points.clear();
  matchmaker::MatchOptions walked;
  walked.engine = matchmaker::MatchEngine::kOutline;
  calls.push_back(match_call("match, outline", bumps, round, walked));
}

}  // namespace

std::string bytes_of_valid(const certify::Parametrization& map, const mesh::Surface& input) {
  if (!map.certificate.ok) throw WrongResult("a map came back whose certificate is not ok");
  if (!map.uv.allFinite() || !map.uv32.allFinite() || !std::isfinite(map.certificate.energy))
    throw WrongResult("a map came back that is not finite");
  certify::Parametrization again = map;
  ExecutionContext context;
  certify::certify_map(again, input, {}, context);
  if (!again.certificate.ok) throw WrongResult("a map came back that is not valid");
  std::string bytes;
  append_matrix(bytes, map.surface.vertices);
  append_matrix(bytes, map.surface.faces);
  append_matrix(bytes, map.uv);
  append_matrix(bytes, map.uv32);
  append(bytes, map.parent_face);
  append(bytes, map.vertex_parent);
  append_matrix(bytes, map.vertex_barycentric);
  append_matrix(bytes, map.cut_edges);
  append(bytes, &map.certificate.energy, 1);
  return bytes;
}

std::string result_of(const Call& call, int threads) {
  ExecutionContext context;
  context.threads = threads;
  return call.run(context, 0);
}

std::string identifier(const std::string& name) {
  std::string result;
  for (const char c : name) {
    if (std::isalnum(static_cast<unsigned char>(c)) != 0)
      result += c;
    else if (c == ' ')
      result += '_';
  }
  return result;
}

std::vector<Call> map_calls() {
  std::vector<Call> calls;
  add_unwraps(calls);
  add_layouts(calls);
  add_embeddings(calls);
  add_matches(calls);
  return calls;
}

std::vector<Call> all_calls() {
  std::vector<Call> calls = map_calls();
  for (Call& call : conformal_calls()) calls.push_back(std::move(call));
  for (Call& call : seamless_calls()) calls.push_back(std::move(call));
  return calls;
}

}  // namespace flipfree::test
