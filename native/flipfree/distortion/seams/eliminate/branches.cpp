#include "flipfree/distortion/seams/eliminate/branches.h"

#include <numeric>

namespace flipfree::distortion {

using numeric::GaussianInteger;
using numeric::LinearForm;

namespace {

std::size_t size(Index i) { return static_cast<std::size_t>(i); }

GaussianInteger conjugate(const GaussianInteger& a) { return {a.re, -a.im}; }

}  // namespace

Branches::Branches(std::size_t count) : parent_(count), unit_(count, {1, 0}) {
  std::iota(parent_.begin(), parent_.end(), Index{0});
}

std::pair<Index, GaussianInteger> Branches::root(Index e) {
  GaussianInteger unit{1, 0};
  Index top = e;
  while (parent_[size(top)] != top) {
    unit = unit * unit_[size(top)];
    top = parent_[size(top)];
  }
  // Path compression.
  GaussianInteger rest = unit;
  while (parent_[size(e)] != top && e != top) {
    const Index next = parent_[size(e)];
    const GaussianInteger own = unit_[size(e)];
    parent_[size(e)] = top;
    unit_[size(e)] = rest;
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
    parent_[size(p)] = q;
    unit_[size(p)] = conjugate(a) * unit * b;
  } else {
    parent_[size(q)] = p;
    unit_[size(q)] = conjugate(unit * b) * a;
  }
  return {};
}

}  // namespace flipfree::distortion
