#include <cmath>

#include "finding.h"
#include "flipfree/distortion/rounding.h"
#include "planar_maps.h"
#include "rational.h"
#include "targets.h"

namespace flipfree::fuzz {

void fuzz_rounding(Bytes bytes) {
  const Index wishes = bytes.byte();
  PlanarMap map = read_planar_map(bytes, false);
  // Crowded: shrunk beside an offset, so that floats cannot hold all of it.
  if ((wishes & 1) != 0) {
    const Points2 before = map.uv;
    map.uv *= std::pow(2.0, -bytes.below(40));
    map.uv.rowwise() += Eigen::RowVector2d(bytes.number(), bytes.eighth());
    if (!map.uv.allFinite() || !(map.uv.cwiseAbs().maxCoeff() < 1e30)) map.uv = before;
  }
  const auto corner = [&](const Points2& uv, FaceId f, Index k) {
    return exact(uv.row(map.cut.faces(f, k)).transpose());
  };
  const auto all_positive = [&](const Points2& uv) {
    for (FaceId f = 0; f < map.cut.faces.rows(); ++f) {
      if (side(corner(uv, f, 0), corner(uv, f, 1), corner(uv, f, 2)) <= 0) return false;
    }
    return true;
  };
  if (!all_positive(map.uv)) return;
  distortion::RoundingOptions options;
  for (Index n = wishes >> 6; n > 0; --n) {
    const VertexId v = bytes.below(static_cast<Index>(map.uv.rows()));
    const Points2 before = map.uv;
    map.uv.row(v) = map.uv.row(v).cast<float>().cast<double>().eval();
    if (!map.uv.allFinite() || !all_positive(map.uv)) {  // beyond floats
      map.uv = before;
    } else {
      options.fixed.push_back(v);
    }
  }
  ExecutionContext context;
  const TimeLimit limit(context, 20.0);
  Stats stats;
  Points2f stored;
  if (!allowed([&] {
        stored = distortion::round_to_storage(map.cut.faces, map.uv, options, context, stats);
      }))
    return;
  require(stored.rows() == map.uv.rows() && stored.allFinite(), "values are missing");
  require(all_positive(stored.cast<double>()), "a triangle is flipped as stored");
  for (const VertexId v : options.fixed) {
    require(stored.row(v) == Points2f(map.uv.cast<float>()).row(v), "a fixed vertex was moved");
  }
}

}  // namespace flipfree::fuzz
