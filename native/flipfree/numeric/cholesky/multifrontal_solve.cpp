// Multifrontal: solving with the factor.
#include <algorithm>
#include <vector>

#include "flipfree/base/parallel.h"
#include "flipfree/numeric/cholesky/multifrontal.h"
#include "flipfree/numeric/dense_kernels.h"

namespace flipfree::numeric {
namespace {}  // namespace

// x of the supernode's columns is solved; its rows below are updated, inside a task those past the
// task in `outside`.
void Multifrontal::forward(Index s, double* x, Index count, double* work, const Task* task,
                           double* outside) const {
  const Index c = width(s);
  const Index r = below(s);
  const double* panel = factor_ + panel_[at(s)];
  double* own = x + wide(block_) * s_.first[at(s)];
  if (count == 1 && c <= dense::kNarrow) {
    dense::solve_trapezoid(c, r, panel, own, work);
  } else {
    dense::solve_left(c, count, panel, c + r, own, size_);
    if (r > 0) dense::product(r, c, count, panel + c, c + r, own, size_, work, r);
  }
  if (r == 0) return;
  const Index* target = target_.data() + s_.rows_begin[at(s)];
  const Index rows = s_.rows_below(s);
  const Index inside = inside_[at(s)];
  const auto subtract = [&](const double* from, double* to, Index begin, Index end) {
    if (block_ == 1) {
      for (Index i = begin; i < end; ++i) to[target[i]] -= from[i];
      return;
    }
    for (Index i = begin; i < end; ++i) {
      for (Index b = 0; b < block_; ++b)
        to[wide(block_) * target[i] + b] -= from[wide(block_) * i + b];
    }
  };
  for (Index k = 0; k < count; ++k) {
    const double* from = work + wide(k) * r;
    subtract(from, x + wide(k) * size_, 0, inside);
    if (inside < rows) subtract(from, outside + wide(k) * below(task->root), inside, rows);
  }
}

void Multifrontal::backward(Index s, double* x, Index count, double* work) const {
  const Index c = width(s);
  const Index r = below(s);
  const double* panel = factor_ + panel_[at(s)];
  double* own = x + wide(block_) * s_.first[at(s)];
  const Index* rows = s_.rows.data() + s_.rows_begin[at(s)];
  for (Index k = 0; k < count; ++k) {
    const double* from = x + wide(k) * size_;
    double* to = work + wide(k) * r;
    for (Index i = 0; i < s_.rows_below(s); ++i) {
      for (Index b = 0; b < block_; ++b)
        to[wide(block_) * i + b] = from[wide(block_) * rows[i] + b];
    }
  }
  if (count == 1 && c <= dense::kNarrow) {
    dense::solve_trapezoid_transposed(c, r, panel, own, work);
    return;
  }
  if (r > 0) dense::subtract_transposed_product(r, c, count, panel + c, c + r, work, r, own, size_);
  dense::solve_left_transposed(c, count, panel, c + r, own, size_);
}

// rhs -> x in the order of elimination, or back.
void Multifrontal::permute(double* rhs, double* x, Index count, bool back) const {
  for (Index k = 0; k < count; ++k) {
    for (std::size_t v = 0; v < s_.order.size(); ++v) {
      for (Index b = 0; b < block_; ++b) {
        double& ordered = x[at(k) * at(size_) + at(block_) * v + at(b)];
        double& given = rhs[wide(k) * size_ + wide(block_) * s_.order[v] + b];
        (back ? given : ordered) = back ? ordered : given;
      }
    }
  }
}

void Multifrontal::solve(double* rhs, Index count, const ExecutionContext& context) const {
  const dense::Calls calls(context.threads);
  std::vector<double> x(at(size_) * at(count));
  permute(rhs, x.data(), count, false);
  std::vector<double> outside(at(outside_size_) * at(count), 0.0);
  const std::size_t work_size = at(widest_below_) * at(count);
  parallel_for(context, tasks_.size(), 1, [&](std::size_t t, std::size_t, std::size_t) {
    std::vector<double> work(work_size);
    const Task& task = tasks_[t];
    for (Index s = task.begin; s <= task.root; ++s) {
      if (s % 1024 == 0) context.check();
      forward(s, x.data(), count, work.data(), &task, outside.data() + task.outside * count);
    }
  });
  for (const Task& task : tasks_) {
    const Index* rows = s_.rows.data() + s_.rows_begin[at(task.root)];
    for (Index k = 0; k < count; ++k) {
      const double* from = outside.data() + task.outside * count + wide(k) * below(task.root);
      double* to = x.data() + wide(k) * size_;
      for (Index i = 0; i < s_.rows_below(task.root); ++i) {
        for (Index b = 0; b < block_; ++b)
          to[wide(block_) * rows[i] + b] += from[wide(block_) * i + b];
      }
    }
  }
  std::vector<double> work(work_size);
  for (const Index s : top_) {
    context.check();
    forward(s, x.data(), count, work.data(), nullptr, nullptr);
  }
  for (auto s = top_.rbegin(); s != top_.rend(); ++s) {
    context.check();
    backward(*s, x.data(), count, work.data());
  }
  parallel_for(context, tasks_.size(), 1, [&](std::size_t t, std::size_t, std::size_t) {
    std::vector<double> local(work_size);
    for (Index s = tasks_[t].root; s >= tasks_[t].begin; --s) {
      if (s % 1024 == 0) context.check();
      backward(s, x.data(), count, local.data());
    }
  });
  permute(rhs, x.data(), count, true);
}

}  // namespace flipfree::numeric
