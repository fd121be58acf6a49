#include "flipfree/unwrap/repair/stretched_islands.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "flipfree/base/failure.h"
#include "flipfree/base/plane.h"
#include "flipfree/certify/measures.h"
#include "flipfree/distortion/energy/energy.h"
#include "flipfree/distortion/energy/own_map.h"
#include "flipfree/distortion/minimize/boundary_barrier.h"
#include "flipfree/distortion/minimize/minimize.h"
#include "flipfree/mesh/own_unit.h"
#include "flipfree/unwrap/packing/layout.h"
#include "flipfree/unwrap/repair/given/given_map.h"
#include "flipfree/unwrap/repair/patches/damage.h"

namespace flipfree::unwrap {
namespace {

using Pins = std::vector<std::pair<VertexId, Vector2>>;

// A part of a chart with the map that it has there.
struct Piece {
  mesh::Chart chart;                    // faces of the whole; vertices of its own
  std::vector<VertexId> vertex_origin;  // of the whole
  Points2 uv;                           // #V x 2
};

// What the whole falls into along `cut` (empty: nothing). corner_uv: 3 #F x 2 of the whole.
std::vector<Piece> pieces_of(const mesh::Surface& whole, const mesh::Adjacency& adjacency,
                             const mesh::EdgeFlags& cut, const Points2& corner_uv) {
  const mesh::CutMesh mesh = mesh::cut_along(
      whole.faces, adjacency, cut.empty() ? mesh::EdgeFlags(adjacency.opposite.size(), 0) : cut);
  std::vector<Piece> pieces;
  for (mesh::Chart& chart : mesh::split_into_charts(whole.vertices, mesh)) {
    Piece& piece = pieces.emplace_back();
    piece.uv.resize(chart.surface.vertices.rows(), 2);
    for (std::size_t h = 0; h < 3 * chart.faces.size(); ++h)
      piece.uv.row(chart.surface.faces.data()[h]) =
          corner_uv.row(3 * chart.faces[h / 3] + static_cast<Index>(h % 3));
    for (const VertexId v : chart.vertices)
      piece.vertex_origin.push_back(mesh.vertex_origin[at(v)]);
    std::iota(chart.vertices.begin(), chart.vertices.end(), 0);
    piece.chart = std::move(chart);
  }
  return pieces;
}

double sum_of_areas(const std::vector<double>& areas) {
  double sum = 0.0;
  for (const double a : areas) sum += a;
  return sum;
}

double energy_in_own_unit(const mesh::Surface& surface, const Points2& uv) {
  const mesh::InOwnUnit own(surface);
  return certify::symmetric_dirichlet(own.surface(), by_corner(surface.faces, uv)).mean;
}

// UV length per surface length that a map was meant to have: the median of its faces by area, or
// `usual` where a twentieth of them has less and a twentieth more: drawn out as they are, they do
// not tell it well.
double meant_density(const mesh::Surface& surface, const Points2& uv, double usual) {
  const mesh::InOwnUnit own(surface);
  const std::vector<double> areas = face_areas(own.surface());
  std::vector<std::pair<double, double>> ratios;  // and area
  double total = 0.0;
  for (FaceId f = 0; f < surface.faces.rows(); ++f) {
    const auto corner = [&](Index k) -> Vector2 { return uv.row(surface.faces(f, k)).transpose(); };
    const double ratio = 0.5 * twice_area(corner(0), corner(1), corner(2)) / areas[at(f)];
    if (!std::isfinite(ratio)) continue;
    ratios.emplace_back(ratio, areas[at(f)]);
    total += areas[at(f)];
  }
  const double scaled = usual * own.unit();
  double below = 0.0;
  for (const auto& [ratio, area] : ratios) below += ratio <= scaled * scaled ? area : 0.0;
  constexpr double kFew = 0.05;
  const bool among = below >= kFew * total && below <= (1.0 - kFew) * total;
  return among ? usual : median_density(surface, uv);
}

class Judgement {
 public:
  Judgement(const ChartToMend& given, const RepairOptions& options, MendedChart& mended,
            ExecutionContext& context)
      : given_(given),
        options_(options),
        mended_(mended),
        context_(context),
        adjacency_(mesh::build_adjacency(static_cast<Index>(given.chart.surface.vertices.rows()),
                                         given.chart.surface.faces)) {}

  void run() {
    const mesh::EdgeFlags cut = mended_.cut;
    for (const Piece& piece : pieces_of(given_.chart.surface, adjacency_, cut, mended_.uv))
      judge(piece);
  }

 private:
  void judge(const Piece& piece) {
    const mesh::Surface& surface = piece.chart.surface;
    const double energy = energy_in_own_unit(surface, piece.uv);
    // No map's energy is below 1.
    if (!(energy > kStretchedRatio)) return;
    const bool count_only = options_.stretched != StretchedIslands::kImprove;
    if (count_only && surface.faces.rows() > kMostJudged) return;
    const Pins pins = pins_of(piece);
    bool holds_pins = true;
    Outcome<MendedChart> anew = unwrapped(piece, pins);
    if (!anew && !pins.empty()) {
      holds_pins = false;
      anew = unwrapped(piece, {});
    }
    if (!anew) return;  // nothing to compare with
    const mesh::Adjacency adjacency =
        mesh::build_adjacency(static_cast<Index>(surface.vertices.rows()), surface.faces);
    const std::vector<Piece> parts = pieces_of(surface, adjacency, anew->cut, anew->uv);
    const double bound = kStretchedRatio * energy_of_all(parts);
    if (energy <= bound) return;
    if (count_only) {
      ++mended_.stretched.left;
      return;
    }
    if (mended_.before.rows() == 0) mended_.before = mended_.uv;
    Points2 improved = improved_in_place(piece, pins);
    const double now = energy_in_own_unit(surface, improved);
    if (now > bound && holds_pins) {
      take_anew(piece, parts, anew->cut);
      ++mended_.stretched.anew;
      return;
    }
    if (now < energy) {
      take(piece, piece, pins, std::move(improved));
      ++mended_.stretched.improved;
    }
    mended_.stretched.left += now > bound;
  }

  Pins pins_of(const Piece& piece) const {
    Pins pins;
    for (std::size_t v = 0; v < piece.vertex_origin.size(); ++v) {
      const auto found = std::lower_bound(
          given_.pins.begin(), given_.pins.end(), piece.vertex_origin[v],
          [](const std::pair<VertexId, Vector2>& pin, VertexId w) { return pin.first < w; });
      if (found == given_.pins.end() || found->first != piece.vertex_origin[v]) continue;
      pins.emplace_back(static_cast<VertexId>(v), found->second);
    }
    return pins;
  }

  Outcome<MendedChart> unwrapped(const Piece& piece, const Pins& pins) const {
    const std::vector<char> known(piece.vertex_origin.size(), 0);
    const ChartToMend whole{piece.chart,
                            piece.vertex_origin,
                            piece.uv,
                            known,
                            pins,
                            own_flags(given_.seams, piece.chart),
                            own_flags(given_.uncuttable, piece.chart),
                            given_.density};
    return attempt([&] { return mend_chart(whole, options_, true, context_); });
  }

  // Each part at its own best scale.
  static double energy_of_all(const std::vector<Piece>& parts) {
    double sum = 0.0;
    double total = 0.0;
    for (const Piece& part : parts) {
      const double area = sum_of_areas(face_areas(part.chart.surface));
      if (!(area > 0.0)) continue;
      sum += area * energy_in_own_unit(part.chart.surface, part.uv);
      total += area;
    }
    return total > 0.0 ? sum / total : std::numeric_limits<double>::infinity();
  }

  // As it was where that fails.
  Points2 improved_in_place(const Piece& piece, const Pins& pins) const {
    const mesh::InOwnUnit own(piece.chart.surface);
    const auto count = static_cast<Index>(piece.uv.rows());
    distortion::MinimizeOptions minimize;
    minimize.max_iterations = options_.max_iterations;
    minimize.tolerance = options_.tolerance;
    minimize.bijective = !distortion::overlaps_itself(
        distortion::find_boundary(count, own.surface().faces), piece.uv, context_);
    for (const auto& [v, uv] : pins) minimize.fixed.push_back(v);
    Stats ignored;
    auto improved = attempt([&] {
      return distortion::with_own_map([&] {
        return distortion::minimize_distortion(own.surface(), piece.uv, minimize, context_,
                                               ignored);
      });
    });
    return improved ? std::move(*improved) : piece.uv;
  }

  void take_anew(const Piece& piece, const std::vector<Piece>& parts, const mesh::EdgeFlags& cut) {
    for (const Piece& part : parts) {
      Piece before = part;  // of the whole, with the map that it had
      for (FaceId& f : before.chart.faces) f = piece.chart.faces[at(f)];
      for (VertexId& v : before.vertex_origin) {
        before.uv.row(&v - before.vertex_origin.data()) = piece.uv.row(v);
        v = piece.vertex_origin[at(v)];
      }
      take(piece, before, pins_of(before), part.uv);
    }
    if (cut.empty()) return;
    if (mended_.cut.empty()) mended_.cut.assign(adjacency_.opposite.size(), 0);
    for (std::size_t h = 0; h < cut.size(); ++h)
      mended_.cut[3 * at(piece.chart.faces[h / 3]) + h % 3] |= cut[h];
  }

  // `uv` as the map of the part, at the size and the place of the piece.
  void take(const Piece& piece, const Piece& part, const Pins& pins, Points2 uv) {
    Place place = Place::kStays;
    if (pins.empty()) {
      place = put_back(part, meant_density(piece.chart.surface, piece.uv, given_.density), uv);
      if (mended_.place[at(part.chart.faces.front())] == Place::kNone) place = Place::kNone;
    }
    const std::vector<FaceId>& faces = part.chart.faces;
    for (std::size_t h = 0; h < 3 * faces.size(); ++h) {
      mended_.place[at(faces[h / 3])] = place;
      if (pins.empty()) mended_.remade[at(faces[h / 3])] = 1;
      mended_.uv.row(3 * faces[h / 3] + static_cast<Index>(h % 3)) =
          uv.row(part.chart.surface.faces.data()[h]);
    }
  }

  Place put_back(const Piece& part, double density, Points2& uv) const {
    const double own = median_density(part.chart.surface, uv);
    if (!(density > 0.0) || !(own > 0.0)) return Place::kNone;
    uv *= density / own;
    Points2 placed = moved(fit_motion(uv, part.uv), uv);
    if (!distortion::is_flip_free(part.chart.surface.faces, placed, context_)) return Place::kNone;
    uv = std::move(placed);
    return Place::kWhereItWas;
  }

  const ChartToMend& given_;
  const RepairOptions& options_;
  MendedChart& mended_;
  ExecutionContext& context_;
  const mesh::Adjacency adjacency_;
};

}  // namespace

void judge_stretched(const ChartToMend& given, const RepairOptions& options, MendedChart& mended,
                     ExecutionContext& context) {
  if (options.stretched == StretchedIslands::kIgnore || mended.change == Change::kAnew) return;
  Judgement judge(given, options, mended, context);
  if (options.stretched == StretchedIslands::kImprove) {
    judge.run();
    return;
  }
  const TimeLimit limit(context,
                        seconds_to_search(context.seconds_left(),
                                          static_cast<Index>(given.chart.surface.faces.rows())));
  try {
    judge.run();
  } catch (const TimeIsOver&) {
    // It is only a count.
  }
}

}  // namespace flipfree::unwrap
