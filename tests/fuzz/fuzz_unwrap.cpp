#include <cmath>
#include <vector>

#include "finding.h"
#include "flipfree/unwrap/unwrap.h"
#include "judge.h"
#include "meshes.h"
#include "targets.h"

namespace flipfree::fuzz {

void fuzz_unwrap(Bytes bytes) {
  const Index wishes = bytes.byte();
  const mesh::Surface surface = read_mesh(bytes, Kind::kAny, 32);
  const auto vertices = static_cast<Index>(surface.vertices.rows());
  unwrap::UnwrapOptions options;
  options.bijective = (wishes & 1) == 0;
  options.cut_extremities = (wishes & 2) == 0;
  options.may_add_cuts = (wishes & 4) == 0;
  options.max_iterations = (wishes & 8) == 0 ? 20 : 200;
  options.max_seconds = 10.0;
  std::vector<Index> pairs;
  for (Index n = bytes.below(8); n > 0; --n) {
    const FaceId f = bytes.below(static_cast<Index>(surface.faces.rows()));
    const Index k = bytes.below(3);
    const bool edge = bytes.byte() != 255;
    pairs.push_back(surface.faces(f, k));
    pairs.push_back(edge ? surface.faces(f, (k + 1) % 3) : read_id(bytes, vertices));
  }
  options.cuts =
      Eigen::Map<const IndexPairs>(pairs.data(), static_cast<Eigen::Index>(pairs.size() / 2), 2);
  if ((wishes & 16) != 0) {
    for (Index n = bytes.below(5); n > 0; --n) {
      const CornerId c = read_id(bytes, static_cast<Index>(3 * surface.faces.rows()));
      const double u = bytes.number();
      options.pins.push_back({c, Vector2(u, bytes.number())});
    }
  }
  if ((wishes & 32) != 0) {
    options.place_like.emplace(3 * surface.faces.rows(), 2);
    for (double& x : options.place_like->reshaped()) x = bytes.number();
  }
  ExecutionContext context;
  certify::Parametrization map;
  if (!allowed([&] { map = unwrap::unwrap(surface, options, context); }, &surface)) return;

  require(map.certificate.ok, "a map without a certificate");
  require(std::isfinite(map.certificate.energy), "a certificate whose energy is not finite");
  require(map.surface.faces.triangles() == surface.faces.triangles() &&
              map.surface.vertices == surface.vertices,
          "unwrap changed the mesh");
  require(map.uv.allFinite() && map.uv32.allFinite(), "a value is not finite");
  const Points2 stored = map.uv32.cast<double>();
  for (const Points2& uv : {map.uv, stored}) {
    const Judge judge(surface, uv);
    require(judge.flipped().empty(), "a face is flipped");
    require(judge.winding().empty(), "a vertex is wound around more than once");
    if (!options.bijective) continue;
    for (const FaceId chart : judge.charts())
      require(!judge.covers_twice(chart), "an island covers points twice");
    if (options.pins.empty()) require(judge.island_pairs() == 0, "islands overlap");
  }
  for (const certify::CornerPin& pin : options.pins) {
    require(map.uv.row(pin.corner) == pin.uv.transpose(), "a pin is not met");
    require(map.uv32.row(pin.corner) == pin.uv.cast<float>().transpose(),
            "a pin is not met as stored");
  }
}

}  // namespace flipfree::fuzz
