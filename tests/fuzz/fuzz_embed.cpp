#include <cmath>
#include <numbers>
#include <vector>

#include "finding.h"
#include "flipfree/embedding/embed.h"
#include "flipfree/mesh/adjacency.h"
#include "meshes.h"
#include "rational.h"
#include "targets.h"

namespace flipfree::fuzz {
namespace {

// A polygon with a place for each of `count` corners: one of ours, one whose corners are moved, a
// triangle with points on its sides, or anything.
Points2 read_polygon(Bytes& bytes, Index count) {
  const Index kind = bytes.below(6);
  Points2 polygon(count, 2);
  if (kind < 3) {
    const auto shape = static_cast<embedding::BoundaryShape>(kind);
    std::vector<double> lengths(static_cast<std::size_t>(count), 1.0);
    if (bytes.flag()) {
      for (double& length : lengths) length = std::ldexp(1.0, bytes.below(41) - 20);
    }
    return embedding::place_boundary(shape, lengths);
  }
  for (Index i = 0; i < count; ++i) {
    const double angle = 2.0 * std::numbers::pi * i / count;
    polygon.row(i) << std::cos(angle), std::sin(angle);
  }
  if (kind == 3) return polygon * std::pow(10.0, bytes.below(81) - 40);
  if (kind == 4) {
    polygon.row(bytes.below(count)) += Eigen::RowVector2d(bytes.eighth(), bytes.eighth());
    return polygon;
  }
  for (double& x : polygon.reshaped()) x = bytes.number();
  return polygon;
}

}  // namespace

void fuzz_embed(Bytes bytes) {
  const Index wishes = bytes.byte();
  const mesh::Surface surface = read_mesh(bytes, Kind::kDisk, 60);
  const auto vertices = static_cast<Index>(surface.vertices.rows());
  const std::vector<VertexId> loop =
      mesh::boundary_loops(surface.faces, surface.adjacency()).front();
  embedding::EmbedOptions options;
  options.float32 = (wishes & 1) != 0;
  options.method =
      (wishes & 4) != 0 ? embedding::EmbedMethod::kLadder : embedding::EmbedMethod::kProgressive;
  options.start_from_tutte = (wishes & 16) != 0;
  Points2 initial(vertices, 2);
  if ((wishes & 32) != 0) {
    for (double& x : initial.reshaped()) x = bytes.number();
    options.initial = initial;
  }
  ExecutionContext context;
  const TimeLimit limit(context, 5.0);
  Points2 polygon;
  embedding::Embedding result;
  if (!allowed([&] {
        polygon = read_polygon(bytes, static_cast<Index>(loop.size()));
        result = embedding::embed_disk_refined({surface.faces, vertices, loop, polygon}, options,
                                               context);
      }))
    return;
  require(result.uv.allFinite(), "a value is not finite");
  for (std::size_t i = 0; i < loop.size(); ++i)
    require(result.uv.row(loop[i]) == polygon.row(static_cast<Eigen::Index>(i)),
            "the boundary is not where it was wanted");
  const Points2 stored =
      options.float32 ? Points2(result.uv.cast<float>().cast<double>()) : result.uv;
  for (const Points2& uv : {result.uv, stored}) {
    require(uv.allFinite(), "a stored value is not finite");
    for (FaceId f = 0; f < result.faces.rows(); ++f) {
      const auto at = [&](Index k) { return exact(uv.row(result.faces(f, k)).transpose()); };
      require(side(at(0), at(1), at(2)) > 0, "a face is flipped");
    }
  }
  require(result.uv.rows() == vertices + static_cast<Eigen::Index>(result.halved.size()),
          "sizes do not fit");
}

}  // namespace flipfree::fuzz
