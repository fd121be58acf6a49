#include "flipfree/numeric/cholesky/multifrontal.h"

#include <algorithm>
#include <atomic>
#include <numeric>
#include <queue>
#include <utility>

#include "flipfree/base/parallel.h"
#include "flipfree/numeric/dense_kernels.h"

namespace flipfree::numeric {
namespace {

// benchmarks/cholesky_benchmark.cpp measures them.
constexpr Index kPanelWidth = 128;  // columns eliminated at once in a front
constexpr Index kTile = 256;        // rows, and columns of updates, handled at once
constexpr double kTileFlops = 4e6;  // fronts cheaper than this are not shared between threads

// Calls body(begin, end) for [0, count) in steps of `grain`; on the context's threads if there is
// one.
template <typename Body>
void tiles(const ExecutionContext* parallel, Index count, Index grain, Body body) {
  if (parallel != nullptr && count > grain) {
    parallel_for(*parallel, at(count), at(grain),
                 [&](std::size_t begin, std::size_t end, std::size_t) {
                   body(static_cast<Index>(begin), static_cast<Index>(end));
                 });
  } else {
    for (Index begin = 0; begin < count; begin += grain)
      body(begin, std::min(count, begin + grain));
  }
}

}  // namespace

double* DoubleBuffer::provide(std::int64_t size) {
  if (size > capacity_) {
    // Some more, since the next factor will be a little different. Untouched pages cost nothing.
    capacity_ = size + size / 4;
    data_.reset();
    data_ = std::make_unique_for_overwrite<double[]>(static_cast<std::size_t>(capacity_));
  }
  return data_.get();
}

struct Multifrontal::Stack {
  double* base = nullptr;
  std::int64_t top = 0;
  std::vector<std::pair<Index, std::int64_t>>
      updates;  // supernode, place; the last ones are the next children
};

void Multifrontal::assemble_panel(Index s, const double* values, double* panel) const {
  std::fill(panel, panel + (panel_[at(s) + 1] - panel_[at(s)]), 0.0);
  for (std::int64_t e = entry_begin_[at(s)]; e < entry_begin_[at(s) + 1]; ++e) {
    panel[entry_target_[at(e)]] += values[entry_source_[at(e)]];
  }
}

namespace {

// Adds one column of a child's update, from row `begin` (in blocks) on, to `target`; relative holds
// block rows.
inline void add_column(const double* source, const Index* relative, Index begin, Index end,
                       Index block, double* target) {
  if (block == 2) {
    for (Index i = begin; i < end; ++i) {
      double* to = target + 2 * static_cast<std::int64_t>(relative[i]);
      to[0] += source[2 * i];
      to[1] += source[2 * i + 1];
    }
  } else {
    for (Index i = begin; i < end; ++i) {
      for (Index k = 0; k < block; ++k) {
        target[static_cast<std::int64_t>(block) * relative[i] + k] += source[block * i + k];
      }
    }
  }
}

}  // namespace

// Above the diagonal, within diagonal blocks, updates hold nothing of meaning and neither does
// their sum.
void Multifrontal::add_to_panel(Index child, const double* update, double* panel,
                                const ExecutionContext* parallel) const {
  const Index parent = s_.parent[at(child)];
  const std::int64_t ld_child = below(child);
  const std::int64_t ld = width(parent) + below(parent);
  const Index* relative = s_.relative.data() + s_.rows_begin[at(child)];
  const Index rows = s_.rows_below(child);
  const auto in_panel = static_cast<Index>(
      std::lower_bound(relative, relative + rows, s_.columns(parent)) - relative);
  tiles(parallel, in_panel, kTile, [&](Index begin, Index end) {
    for (Index j = begin; j < end; ++j) {
      for (Index k = 0; k < block_; ++k) {
        add_column(update + (wide(block_) * j + k) * ld_child, relative, j, rows, block_,
                   panel + (wide(block_) * relative[j] + k) * ld);
      }
    }
  });
}

void Multifrontal::add_to_update(Index child, const double* update, double* target,
                                 const ExecutionContext* parallel) const {
  const Index parent = s_.parent[at(child)];
  const std::int64_t ld_child = below(child);
  const std::int64_t ld = below(parent);
  const Index* relative = s_.relative.data() + s_.rows_begin[at(child)];
  const Index rows = s_.rows_below(child);
  const Index columns = s_.columns(parent);
  const auto in_panel =
      static_cast<Index>(std::lower_bound(relative, relative + rows, columns) - relative);
  tiles(parallel, rows - in_panel, kTile, [&](Index begin, Index end) {
    for (Index j = in_panel + begin; j < in_panel + end; ++j) {
      for (Index k = 0; k < block_; ++k) {
        // Relative rows count from the top of the parent's front; its update starts below the
        // columns.
        double* column = target + (wide(block_) * (relative[j] - columns) + k) * ld;
        add_column(update + (wide(block_) * j + k) * ld_child, relative, j, rows, block_,
                   column - wide(block_) * columns);
      }
    }
  });
}

// Left-looking over panels of columns: the rows of each are updated by all columns before, then
// divided.
bool Multifrontal::factor_panel(Index s, double* panel, const ExecutionContext* parallel) const {
  const Index c = width(s);
  const Index f = c + below(s);
  const std::int64_t ld = f;
  for (Index k = 0; k < c; k += kPanelWidth) {
    const Index w = std::min(kPanelWidth, c - k);
    double* diagonal = panel + k * ld + k;
    if (k > 0) dense::subtract_square(w, k, panel + k, f, 1.0, diagonal, f);
    if (!dense::cholesky(w, diagonal, f)) return false;
    const Index rest = f - k - w;
    tiles(parallel, rest, kTile, [&](Index begin, Index end) {
      double* rows = panel + k * ld + k + w + begin;
      if (k > 0)
        dense::subtract_product(end - begin, w, k, panel + k + w + begin, f, panel + k, f, 1.0,
                                rows, f);
      dense::solve_right_transposed(end - begin, w, diagonal, f, rows, f);
    });
  }
  return true;
}

// update = -L21 L21', tile by tile.
void Multifrontal::form_update(Index s, const double* panel, double* update,
                               const ExecutionContext* parallel) const {
  const Index c = width(s);
  const Index r = below(s);
  const Index f = c + r;
  const double* l = panel + c;
  const Index steps = (r + kTile - 1) / kTile;
  const Index pairs = steps * (steps + 1) / 2;
  tiles(parallel, pairs, 1, [&](Index pair, Index) {
    Index i = 0;
    while (pair > i) pair -= ++i;
    const Index row = i * kTile;
    const Index column = pair * kTile;
    double* target = update + wide(column) * r + row;
    if (i == pair) {
      dense::subtract_square(std::min(kTile, r - row), c, l + row, f, 0.0, target, r);
    } else {
      dense::subtract_product(std::min(kTile, r - row), std::min(kTile, r - column), c, l + row, f,
                              l + column, f, 0.0, target, r);
    }
  });
}

// One front: assemble, eliminate, leave the update on the stack in place of the children's.
bool Multifrontal::eliminate(Index s, const double* values, Stack& stack,
                             const ExecutionContext* parallel) {
  if (parallel != nullptr && front_flops(s) < kTileFlops) parallel = nullptr;
  double* panel = factor_ + panel_[at(s)];
  assemble_panel(s, values, panel);
  const Index children_begin = child_begin_[at(s)];
  const Index children_end = child_begin_[at(s) + 1];
  Index on_stack = 0;
  for (Index c = children_begin; c < children_end; ++c) {
    if (task_of_[at(child_[at(c)])] == kInvalid) ++on_stack;
  }
  std::size_t next = stack.updates.size() - at(on_stack);
  const std::size_t first = next;
  const auto update_of = [&](Index child) {
    const Index task = task_of_[at(child)];
    if (task != kInvalid)
      return static_cast<const double*>(memory_.handed.get() + tasks_[at(task)].update);
    return static_cast<const double*>(stack.base + stack.updates[next++].second);
  };
  for (Index c = children_begin; c < children_end; ++c) {
    const Index child = child_[at(c)];
    add_to_panel(child, update_of(child), panel, parallel);
  }
  if (!factor_panel(s, panel, parallel)) return false;

  const std::int64_t own = wide(below(s)) * below(s);
  double* update = stack.base + stack.top;
  if (own > 0) {
    form_update(s, panel, update, parallel);
    next = first;
    for (Index c = children_begin; c < children_end; ++c) {
      const Index child = child_[at(c)];
      add_to_update(child, update_of(child), update, parallel);
    }
  }
  const std::int64_t place = on_stack > 0 ? stack.updates[first].second : stack.top;
  if (place != stack.top) std::copy(update, update + own, stack.base + place);
  stack.updates.resize(first);
  stack.updates.emplace_back(s, place);
  stack.top = place + own;
  return true;
}

void Multifrontal::advance(double flops, ExecutionContext& context) {
  const std::scoped_lock lock(progress_mutex_);
  done_flops_ += flops;
  context.report(context.stage(), done_flops_ / total_flops_);
}

bool Multifrontal::factorize(const double* values, ExecutionContext& context) {
  const dense::Calls calls(context.threads);
  factor_ = memory_.factor.provide(panel_.back());
  memory_.handed.provide(handed_size_);
  done_flops_ = 0;
  std::atomic<bool> good{true};
  parallel_for(context, tasks_.size(), 1, [&](std::size_t t, std::size_t, std::size_t) {
    if (!good) return;
    const Task& task = tasks_[t];
    Stack stack;
    DoubleBuffer memory;
    {
      const std::scoped_lock lock(stacks_mutex_);
      if (!memory_.idle.empty()) {
        memory = std::move(memory_.idle.back());
        memory_.idle.pop_back();
      }
    }
    stack.base = memory.provide(task_stack_);
    double flops = 0;
    for (Index s = task.begin; s <= task.root && good; ++s) {
      if (!eliminate(s, values, stack, nullptr)) good = false;
      flops += front_flops(s);
      if (flops > kTileFlops) {
        advance(flops, context);
        flops = 0;
      }
    }
    if (good) {
      const std::int64_t own = wide(below(task.root)) * below(task.root);
      std::copy(memory.get(), memory.get() + own, memory_.handed.get() + task.update);
    }
    advance(flops, context);
    const std::scoped_lock lock(stacks_mutex_);
    memory_.idle.push_back(std::move(memory));
  });
  if (!good) return false;
  Stack stack;
  stack.base = memory_.top.provide(top_stack_);
  for (const Index s : top_) {
    if (!eliminate(s, values, stack, &context)) return false;
    advance(front_flops(s), context);
  }
  return true;
}

}  // namespace flipfree::numeric
