#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include "finding.h"
#include "flipfree/matchmaker/match.h"
#include "flipfree/mesh/adjacency.h"
#include "judge.h"
#include "meshes.h"
#include "targets.h"

namespace flipfree::fuzz {

void fuzz_pins(Bytes bytes) {
  const Index wishes = bytes.byte();
  const mesh::Surface surface =
      read_mesh(bytes, (wishes & 1) != 0 ? Kind::kConnected : Kind::kDisk, 24);
  const auto vertices = static_cast<Index>(surface.vertices.rows());
  matchmaker::MatchRequest request;
  for (Index n = bytes.below(5); n > 0; --n) {
    const VertexId v = read_id(bytes, vertices);
    const double u = bytes.number();
    request.points.push_back({v, Vector2(u, bytes.number())});
  }
  if ((wishes & 2) != 0) {
    // Along edges for a while, then anywhere.
    matchmaker::PinnedLine line;
    const FaceId f = bytes.below(static_cast<Index>(surface.faces.rows()));
    for (Index n = bytes.between(2, 3), k = bytes.below(3); n > 0; --n, ++k)
      line.vertices.push_back(surface.faces(f, k % 3));
    if (bytes.byte() == 255) line.vertices.push_back(read_id(bytes, vertices));
    for (Index n = bytes.between(1, 4); n > 0; --n) {
      const double x = bytes.eighth();
      line.polyline.emplace_back(x, bytes.eighth());
    }
    request.lines.push_back(line);
  }
  if ((wishes & 4) != 0) {
    const auto loops = mesh::boundary_loops(surface.faces, surface.adjacency());
    if (loops.empty()) return;
    request.boundary_loop = loops[static_cast<std::size_t>(bytes.byte()) % loops.size()];
    const auto n = static_cast<double>(request.boundary_loop.size());
    const double turns = 2.0 * std::numbers::pi * bytes.between(1, 2);
    for (std::size_t i = 0; i < request.boundary_loop.size(); ++i) {
      const double angle = turns * static_cast<double>(i) / n;
      const double radius = 1.0 + bytes.eighth() / 17.0;
      request.boundary_uv.emplace_back(radius * std::cos(angle), radius * std::sin(angle));
    }
  }
  matchmaker::MatchOptions options;
  options.optimise = (wishes & 8) == 0;
  options.bijective = (wishes & 16) != 0;
  constexpr std::array kEngines{
      matchmaker::MatchEngine::kAuto,     matchmaker::MatchEngine::kAuto,
      matchmaker::MatchEngine::kFirstTry, matchmaker::MatchEngine::kOutline,
      matchmaker::MatchEngine::kAuto,     matchmaker::MatchEngine::kArms,
      matchmaker::MatchEngine::kAuto,     matchmaker::MatchEngine::kMatchmaker};
  options.engine = kEngines[static_cast<std::size_t>(wishes >> 5) % kEngines.size()];
  options.max_iterations = 20;
  options.max_seconds = 10.0;
  ExecutionContext context;
  certify::Parametrization map;
  if (!allowed([&] { map = matchmaker::match(surface, request, options, context); }, &surface))
    return;

  require(map.certificate.ok, "a map without a certificate");
  require(map.uv.allFinite() && map.uv32.allFinite(), "a value is not finite");
  const Points2 stored = map.uv32.cast<double>();
  // Rational arithmetic takes its time.
  if (map.surface.faces.rows() <= 400) {
    for (const Points2& uv : {map.uv, stored}) {
      const Judge judge(map.surface, uv);
      require(judge.flipped().empty(), "a face is flipped");
      require(judge.winding().empty(), "a vertex is wound around more than once");
    }
  }
  std::vector<matchmaker::PinnedVertex> pins = request.points;
  for (std::size_t i = 0; i < request.boundary_uv.size(); ++i)
    pins.push_back({request.boundary_loop[i], request.boundary_uv[i]});
  for (CornerId c = 0; c < map.uv.rows(); ++c) {
    for (const matchmaker::PinnedVertex& pin : pins) {
      if (map.surface.faces(c / 3, c % 3) != pin.vertex) continue;
      require(map.uv.row(c) == pin.uv.transpose(), "a pin is not met");
      require(map.uv32.row(c) == pin.uv.cast<float>().transpose(), "a pin is not met as stored");
    }
  }
}

}  // namespace flipfree::fuzz
