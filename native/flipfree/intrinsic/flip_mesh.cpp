#include "flipfree/intrinsic/flip_mesh.h"

#include <algorithm>

#include "flipfree/base/debug_check.h"

namespace flipfree::intrinsic {
std::string at_halfedge(const char* what, HalfedgeId h) {
  return std::string(what) + " at half-edge " + std::to_string(h);
}

void flip_edge(FlipMesh& m, EdgeId e) {
  debug_require("flip_edge", "the edge has two faces", [&] { return !is_glued_to_itself(m, e); });
  const HalfedgeId h = 2 * e;
  const HalfedgeId o = h + 1;
  const HalfedgeId hn = m.next[at(h)];
  const HalfedgeId hp = m.next[at(hn)];
  const HalfedgeId on = m.next[at(o)];
  const HalfedgeId op = m.next[at(on)];
  m.next[at(h)] = hp, m.next[at(hp)] = on, m.next[at(on)] = h;
  m.next[at(o)] = op, m.next[at(op)] = hn, m.next[at(hn)] = o;
  m.origin[at(h)] = m.origin[at(op)];
  m.origin[at(o)] = m.origin[at(hp)];
}

bool is_glued_to_itself(const FlipMesh& m, EdgeId e) {
  const HalfedgeId h = 2 * e;
  return m.next_of(h) == (h ^ 1) || m.previous(h) == (h ^ 1);
}

Index count_vertices(const FlipMesh& m) {
  const auto last = std::max_element(m.origin.begin(), m.origin.end());
  return last == m.origin.end() ? 0 : *last + 1;
}

std::string find_broken_invariant(const FlipMesh& m) {
  const auto count = static_cast<Index>(m.next.size());
  if (count % 2 != 0 || m.origin.size() != m.next.size()) return "half-edges without a partner";
  for (HalfedgeId h = 0; h < count; ++h) {
    const HalfedgeId n = m.next[at(h)];
    if (n < 0 || n >= count) return at_halfedge("next out of range", h);
    if (m.origin[at(h)] < 0) return at_halfedge("no origin", h);
  }
  for (HalfedgeId h = 0; h < count; ++h) {
    const HalfedgeId n = m.next[at(h)];
    if (n == h || m.previous(n) != h) return at_halfedge("face orbit is not 3 long", h);
    if (m.origin[at(n)] != m.target(h)) return at_halfedge("ends do not meet", h);
  }
  return {};
}

}  // namespace flipfree::intrinsic
