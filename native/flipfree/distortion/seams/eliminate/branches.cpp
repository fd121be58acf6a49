#include "flipfree/distortion/seams/eliminate/branches.h"

#include <numeric>

namespace flipfree::distortion {

using numeric::GaussianInteger;
using numeric::LinearForm;

namespace {

GaussianInteger conjugate(const GaussianInteger& a) { return {a.re, -a.im}; }

}  // namespace

Branches::Branches(std::size_t count) : parent_(count), unit_(count, {1, 0}) {
  std::iota(parent_.begin(), parent_.end(), Index{0});
}

std::pair<Index, GaussianInteger> Branches::root(Index e) {
  GaussianInteger unit{1, 0};
  Index top = e;
  while (parent_[at(top)] != top) {
    unit = unit * unit_[at(top)];
    top = parent_[at(top)];
  }
  // Path compression.
  GaussianInteger rest = unit;
  while (parent_[at(e)] != top && e != top) {
    const Index next = parent_[at(e)];
    const GaussianInteger own = unit_[at(e)];
    parent_[at(e)] = top;
    unit_[at(e)] = rest;
    rest = rest * conjugate(own);
    e = next;
  }
  return {top, unit};
}

LinearForm Branches::join(Index e, const GaussianInteger& unit, Index f) {
  const auto [p, a] = root(e);
  const auto [q, b] = root(f);
  if (p == q) {
    LinearForm form{{p, a}, {p, -(unit * b)}};
    numeric::normalise(form);
    return form;
  }
  // a t_p = unit b t_q; the lower number stays the root.
  if (p > q) {
    parent_[at(p)] = q;
    unit_[at(p)] = conjugate(a) * unit * b;
  } else {
    parent_[at(q)] = p;
    unit_[at(q)] = conjugate(unit * b) * a;
  }
  return {};
}

}  // namespace flipfree::distortion
