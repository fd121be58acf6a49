#include "flipfree/seamless/padding/paths/free_distances.h"

#include <cstddef>
#include <functional>
#include <queue>
#include <utility>

namespace flipfree::seamless {

FreeDistances free_distances(const Canvas& canvas, const std::vector<HalfedgeId>& first,
                             VertexId root, const ExecutionContext& context) {
  using Entry = std::pair<double, VertexId>;
  const mesh::EditableTriangulation& mesh = canvas.mesh();
  FreeDistances found;
  found.distance.assign(at(canvas.vertex_count()), FreeDistances::kUnreached);
  found.arrival.assign(at(canvas.vertex_count()), kInvalid);
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> queue;
  const auto cross = [&](HalfedgeId h, double so_far) {
    const VertexId v = mesh.target(h);
    const double distance = so_far + canvas.length(h);
    if (!canvas.is_free(v) || distance >= found.distance[at(v)]) return;
    found.distance[at(v)] = distance;
    found.arrival[at(v)] = h;
    queue.push({distance, v});
  };
  for (const HalfedgeId h : first) cross(h, 0.0);
  if (root != kInvalid) {
    found.distance[at(root)] = 0.0;
    found.arrival[at(root)] = kInvalid;
    queue.push({0.0, root});
  }
  std::vector<char> done(found.distance.size(), 0);
  for (int step = 1; !queue.empty(); ++step) {
    if (step % kFreeStepsPerCheck == 0) context.check();
    const auto [distance, v] = queue.top();
    queue.pop();
    if (done[at(v)] != 0) continue;
    done[at(v)] = 1;
    found.order.push_back(v);
    mesh.for_each_outgoing(v, [&, so_far = distance](HalfedgeId h) { cross(h, so_far); });
  }
  return found;
}

}  // namespace flipfree::seamless
