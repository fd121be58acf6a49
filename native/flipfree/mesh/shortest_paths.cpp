#include "flipfree/mesh/shortest_paths.h"

#include <algorithm>

namespace flipfree::mesh {

ShortestPaths::ShortestPaths(const Triangles& faces, const Adjacency& adjacency,
                             const std::vector<double>& length, double longest)
    : faces_(faces),
      adjacency_(adjacency),
      length_(length),
      longest_(longest),
      distance_(adjacency.vertex_halfedge.size(), kUnreached),
      arrival_(adjacency.vertex_halfedge.size(), kInvalid) {}

std::pair<double, VertexId> ShortestPaths::Queue::pop() {
  std::size_t first = 0;
  while (buckets_[first].empty()) ++first;
  if (first > 0) {
    std::vector<Entry>& bucket_of_least = buckets_[first];
    last_ = bucket_of_least.front().bits;
    for (const Entry& e : bucket_of_least) last_ = std::min(last_, e.bits);
    // All of them go to lower buckets, the least to the lowest.
    for (const Entry& e : bucket_of_least) buckets_[bucket(e.bits)].push_back(e);
    bucket_of_least.clear();
  }
  const Entry least = buckets_[0].back();
  buckets_[0].pop_back();
  // Empty: the next may be any.
  if (--count_ == 0) last_ = 0;
  return {std::bit_cast<double>(least.bits), least.vertex};
}

void ShortestPaths::add_source(VertexId v) {
  if (distance(v) == kUnreached) reached_.push_back(v);
  distance_[at(v)] = 0.0;
  arrival_[at(v)] = kInvalid;
  queue_.push(0.0, v);
}

void ShortestPaths::restart(VertexId source, double longest) {
  for (const VertexId v : reached_) {
    distance_[at(v)] = kUnreached;
    arrival_[at(v)] = kInvalid;
  }
  reached_.clear();
  queue_ = {};
  longest_ = longest;
  add_source(source);
}

void ShortestPaths::expand(VertexId from) {
  for_each_outgoing(adjacency_, from, [&](HalfedgeId h) {
    relax(from, target(faces_, h), h);
    // The fan's last edge has no half-edge that leaves v.
    const HalfedgeId last = previous_corner(h);
    if (adjacency_.opposite[at(last)] == kInvalid) relax(from, source(faces_, last), last);
  });
}

void ShortestPaths::relax(VertexId from, VertexId to, HalfedgeId h) {
  const double through = distance(from) + length_[at(h)];
  if (!(through < distance(to)) || through > longest_) return;
  if (distance(to) == kUnreached) reached_.push_back(to);
  distance_[at(to)] = through;
  arrival_[at(to)] = h;
  queue_.push(through, to);
}

VertexId ShortestPaths::before(VertexId v) const {
  const HalfedgeId h = arrival(v);
  const VertexId a = source(faces_, h);
  return a == v ? target(faces_, h) : a;
}

}  // namespace flipfree::mesh
