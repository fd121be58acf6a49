// Shortest paths along edges from a set of sources that may grow (Dijkstra 1959).
#pragma once

#include <array>
#include <bit>
#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/mesh/adjacency.h"

namespace flipfree::mesh {

class ShortestPaths {
 public:
  static constexpr double kUnreached = std::numeric_limits<double>::infinity();

  // `length`: one per half-edge, >= 0, the same for both half-edges of an edge; infinite for edges
  // that no path may use. All three must outlive this. Vertices to which the shortest path is
  // longer than `longest` are not reached.
  ShortestPaths(const Triangles& faces, const Adjacency& adjacency,
                const std::vector<double>& length, double longest = kUnreached);

  void add_source(VertexId v);
  // Brings all distances up to date with the sources. Adding sources after a call costs only what
  // they bring nearer; O(#F log #F) at most.
  void grow(const ExecutionContext& context) {
    grow_to([](VertexId) { return false; }, context);
  }
  // The same, up to the nearest vertex for which wanted(v) is true, which is returned; kInvalid if
  // there is none. The next call goes on there.
  template <typename Wanted>
  VertexId grow_to(const Wanted& wanted, const ExecutionContext& context) {
    std::size_t steps = 0;
    while (!queue_.empty()) {
      const auto [key, v] = queue_.pop();
      if (key > distance(v)) continue;
      if ((++steps & 0xfff) == 0) context.check();
      if (wanted(v)) {
        queue_.push(key, v);
        return v;
      }
      expand(v);
    }
    return kInvalid;
  }
  // Forgets all sources but this one, and how far paths went, in time of what they reached.
  void restart(VertexId source, double longest);

  double distance(VertexId v) const { return distance_[at(v)]; }
  // The edge by which the shortest path arrives at v: the half-edge that points at v, or the only
  // one that a boundary edge has. kInvalid at sources and at vertices that no path reaches.
  HalfedgeId arrival(VertexId v) const { return arrival_[at(v)]; }
  // The vertex before v on its path. Precondition: arrival(v) is valid.
  VertexId before(VertexId v) const;

 private:
  void expand(VertexId from);
  void relax(VertexId from, VertexId to, HalfedgeId h);

  // A priority queue for keys that are never smaller than the last one taken (radix heap: Ahuja,
  // Mehlhorn, Orlin, Tarjan 1990), on the bits of distances, which ascend with them. Entries lie in
  // the bucket of the highest bit in which they differ from the last one taken.
  class Queue {
   public:
    bool empty() const { return count_ == 0; }
    void push(double key, VertexId v) {
      const auto bits = std::bit_cast<std::uint64_t>(key);
      buckets_[bucket(bits)].push_back({bits, v});
      ++count_;
    }
    std::pair<double, VertexId> pop();

   private:
    struct Entry {
      std::uint64_t bits;
      VertexId vertex;
    };
    std::size_t bucket(std::uint64_t bits) const {
      return static_cast<std::size_t>(64 - std::countl_zero(bits ^ last_));
    }
    std::array<std::vector<Entry>, 65> buckets_;
    std::uint64_t last_ = 0;
    std::size_t count_ = 0;
  };

  const Triangles& faces_;
  const Adjacency& adjacency_;
  const std::vector<double>& length_;
  double longest_;
  std::vector<double> distance_;
  std::vector<HalfedgeId> arrival_;
  std::vector<VertexId> reached_;
  Queue queue_;
};

}  // namespace flipfree::mesh
