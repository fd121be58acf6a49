#include "flipfree/unwrap/seams/search/shortened.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "flipfree/mesh/topology.h"

namespace flipfree::unwrap {
namespace {

constexpr int kMostShorteningRounds = 10;
// Of what may still be spent, in a round; when so little is left, or so little was given back, that
// it is done.
constexpr double kSpend = 0.5;
constexpr double kLeft = 0.03;
// Of an end's branch, in a round, and edges in any case.
constexpr double kRetreat = 0.35;
constexpr int kFewEdges = 2;
// Branches of less than this share of all are given back at once, if at all.
constexpr double kStub = 0.04;
// Angle defect of a vertex that is a tip, such as that of a cone: there a slit ends as one expects.
constexpr double kSlitTipDefect = 1.0;

// The part of a way that is left: vertices first .. last.
struct Rest {
  std::size_t first = 0;
  std::size_t last = 0;
};

// What is left of the slits.
struct State {
  std::vector<Rest> rests;
  std::vector<int> degree;  // edges of slits at each vertex
  std::vector<char> open;
  std::size_t edges = 0;
};

// The end of a way, on its way back.
struct End {
  std::size_t way = 0;
  bool front = true;
  double rate = 0.0;   // what a unit of length costs at most so far
  double ratio = 0.0;  // what the next edge costs, for what it gives back
  double gone = 0.0;
  double reach = 0.0;  // how far it may go in this round
  int steps = 0;
};

class Shortener {
 public:
  Shortener(Sheet& sheet, ExecutionContext& context) : sheet_(sheet), context_(context) {
    state_.open = sheet.open();
    state_.degree.assign(state_.open.size(), 0);
    for (const Sheet::Way& way : sheet.ways()) {
      state_.rests.push_back({0, way.vertices.size() - 1});
      state_.edges += way.edges.size();
      for (std::size_t i = 0; i < way.edges.size(); ++i) {
        ++state_.degree[at(way.vertices[i])];
        ++state_.degree[at(way.vertices[i + 1])];
        total_ += length(way, i);
      }
    }
  }

  Shortened run(double most) {
    ScaleField::Response response = sheet_.respond(state_.open, context_);
    double excess = sheet_.excess(response.u);
    double factor = 1.0;  // what is lost, over what was foretold
    for (int round = 0; round < kMostShorteningRounds && most - excess > kLeft * most; ++round) {
      State before = state_;
      const double foretold = retreat(response.closing, kSpend * (most - excess) / factor);
      if (state_.edges == before.edges) break;
      ScaleField::Response next = sheet_.respond(state_.open, context_);
      const double now = sheet_.excess(next.u);
      const double seen = (now - excess) / std::max(foretold, 1e-300);
      if (now <= most) {
        factor = std::clamp(seen, 0.2 * factor, 5.0 * factor);
        excess = now;
        response = std::move(next);
      } else {
        factor = std::clamp(seen, 2.0 * factor, 50.0 * factor);
        state_ = std::move(before);
      }
    }
    return result(excess);
  }

 private:
  double length(const Sheet::Way& way, std::size_t edge) const {
    const Points3& places = sheet_.surface().vertices;
    return (places.row(way.vertices[edge]) - places.row(way.vertices[edge + 1])).norm();
  }
  const Sheet::Way& way_of(const End& end) const { return sheet_.ways()[end.way]; }
  VertexId tip(const End& end) const {
    const Rest& rest = state_.rests[end.way];
    return way_of(end).vertices[end.front ? rest.first : rest.last];
  }
  std::size_t edge_at(const End& end) const {
    const Rest& rest = state_.rests[end.way];
    return end.front ? rest.first : rest.last - 1;
  }
  bool is_end(VertexId v) const { return state_.degree[at(v)] == 1 && !sheet_.on_border(v); }

  void price_of(End& end, const std::vector<double>& closing) const {
    const std::size_t edge = edge_at(end);
    const double step = length(way_of(end), edge);
    const double worth = std::max(sheet_.cost(way_of(end).edges[edge]), 1e-300);
    end.rate = std::max(end.rate, std::max(closing[at(tip(end))], 0.0) / std::max(step, 1e-300));
    end.ratio = end.rate * step / worth;
  }

  // Length from a free end to where its branch begins.
  double branch(End end) const {
    const Rest& rest = state_.rests[end.way];
    const std::vector<VertexId>& vertices = way_of(end).vertices;
    double sum = 0.0;
    std::size_t i = end.front ? rest.first : rest.last;
    do {
      sum += length(way_of(end), end.front ? i : i - 1);
      i = end.front ? i + 1 : i - 1;
    } while (i > rest.first && i < rest.last && state_.degree[at(vertices[i])] == 2);
    return sum;
  }

  // A way and its image after it are taken back together as long as they are the same.
  bool has_image(const End& end) const {
    const std::size_t next = end.way + 1;
    if (!end.front || next == state_.rests.size() || !sheet_.ways()[next].image) return false;
    const Rest& rest = state_.rests[next];
    return rest.first == state_.rests[end.way].first && rest.first != rest.last &&
           is_end(tip({next}));
  }
  bool is_image(const End& end) const {
    return end.front && end.way > 0 && sheet_.ways()[end.way].image && has_image({end.way - 1});
  }

  void add_end(std::vector<End>& ends, std::size_t way, bool front,
               const std::vector<double>& closing) const {
    const Rest& rest = state_.rests[way];
    if (rest.first == rest.last) return;
    End end{way, front};
    if (!is_end(tip(end)) || is_image(end)) return;
    const bool untouched = front ? rest.first == 0 : rest.last + 1 == way_of(end).vertices.size();
    if (untouched && std::abs(sheet_.defect(tip(end))) > kSlitTipDefect) return;
    const double own = branch(end);
    end.reach = own < kStub * total_ ? own : kRetreat * own;
    price_of(end, closing);
    ends.push_back(end);
  }

  // Takes ends back until about `spend` is lost; returns what was foretold for it.
  double retreat(const std::vector<double>& closing, double spend) {
    std::vector<End> ends;
    for (std::size_t w = 0; w < state_.rests.size(); ++w) {
      add_end(ends, w, true, closing);
      add_end(ends, w, false, closing);
    }
    double spent = 0.0;
    const std::size_t least = sheet_.closed() ? 2 : 0;
    while (!ends.empty() && state_.edges > least) {
      const auto best = std::min_element(
          ends.begin(), ends.end(), [](const End& a, const End& b) { return a.ratio < b.ratio; });
      End end = *best;
      ends.erase(best);
      const std::size_t edge = edge_at(end);
      const double step = length(way_of(end), edge);
      const bool both = has_image(end);
      const double price = end.rate * step * (both ? 2.0 : 1.0);
      if (spent + price > spend) continue;
      spent += price;
      if (both) take_back({end.way + 1});
      const VertexId inner = take_back(end);
      end.gone += step;
      ++end.steps;
      Rest& rest = state_.rests[end.way];
      if (rest.first != rest.last && is_end(inner)) {
        if (end.gone >= end.reach && end.steps >= kFewEdges) continue;
        price_of(end, closing);
        ends.push_back(end);
      }
    }
    return spent;
  }

  // One edge; returns the vertex that is the end now.
  VertexId take_back(const End& end) {
    Rest& rest = state_.rests[end.way];
    const VertexId old = tip(end);
    (end.front ? rest.first : rest.last) += end.front ? std::size_t{1} : ~std::size_t{0};
    const VertexId inner = tip(end);
    --state_.edges;
    state_.degree[at(old)] = 0;
    state_.open[at(old)] = 0;
    if (--state_.degree[at(inner)] == 0 && !sheet_.on_border(inner)) state_.open[at(inner)] = 0;
    return inner;
  }

  Shortened result(double excess) const {
    Shortened result;
    result.excess = excess;
    const std::vector<Sheet::Way>& ways = sheet_.ways();
    VertexId root = kInvalid;
    for (std::size_t w = 0; w < ways.size(); ++w) {
      const Rest rest = state_.rests[w];
      const std::vector<VertexId>& vertices = ways[w].vertices;
      if (rest.first == rest.last && !(sheet_.closed() && vertices.size() == 1)) continue;
      const auto begin = static_cast<std::ptrdiff_t>(rest.first);
      const auto end = static_cast<std::ptrdiff_t>(rest.last);
      result.ways.push_back({{vertices.begin() + begin, vertices.begin() + end + 1},
                             {ways[w].edges.begin() + begin, ways[w].edges.begin() + end},
                             ways[w].image});
      if (root == kInvalid && vertices.size() > 1) root = vertices[rest.last];
      for (const VertexId v : result.ways.back().vertices) {
        if (is_end(v) || sheet_.in_hole(v)) result.ends.push_back(v);
      }
    }
    if (sheet_.closed() && root != kInvalid && !result.ways.empty() &&
        result.ways.front().edges.empty())
      result.ways.front().vertices = {root};
    return result;
  }

  Sheet& sheet_;
  ExecutionContext& context_;
  State state_;
  double total_ = 0.0;
};

}  // namespace

Shortened shortened(Sheet& sheet, double most, ExecutionContext& context) {
  return Shortener(sheet, context).run(most);
}

}  // namespace flipfree::unwrap
