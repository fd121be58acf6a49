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

constexpr Index kPanelWidth = 128;  // columns eliminated at once in a front
constexpr Index kTile = 256;        // rows, and columns of updates, handled at once
constexpr double kTileFlops = 4e6;  // fronts cheaper than this are not shared between threads
constexpr double kTaskShare =
    1.0 / 24;                       // no subtree task may cost more than this share of everything
constexpr double kLeastTask = 2e6;  // flops; smaller subtrees are not split off

constexpr std::size_t size(Index i) { return static_cast<std::size_t>(i); }
constexpr std::size_t size(std::int64_t i) { return static_cast<std::size_t>(i); }
constexpr std::int64_t wide(Index i) { return i; }

// Calls body(begin, end) for [0, count) in steps of `grain`; on the context's threads if there is
// one.
template <typename Body>
void tiles(const ExecutionContext* parallel, Index count, Index grain, Body body) {
  if (parallel != nullptr && count > grain) {
    parallel_for(*parallel, size(count), size(grain),
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

Multifrontal::Multifrontal(Supernodes supernodes, Index block, Index size_, const Index* column,
                           const Index* row, const ExecutionContext& context, FactorMemory memory)
    : s_(std::move(supernodes)), block_(block), size_(size_), memory_(std::move(memory)) {
  const Index count = s_.count();
  panel_.assign(1, 0);
  child_begin_.assign(size(count) + 1, 0);
  for (Index s = 0; s < count; ++s) {
    const std::int64_t c = width(s);
    const std::int64_t r = below(s);
    panel_.push_back(panel_.back() + c * (c + r));
    factor_nonzeros_ += c * (c + 1) / 2 + c * r;
    total_flops_ += front_flops(s);
    widest_below_ = std::max(widest_below_, below(s));
    if (s_.parent[size(s)] != kInvalid) ++child_begin_[size(s_.parent[size(s)]) + 1];
  }
  std::partial_sum(child_begin_.begin(), child_begin_.end(), child_begin_.begin());
  child_.resize(size(child_begin_.back()));
  std::vector<Index> next(child_begin_.begin(), child_begin_.end() - 1);
  for (Index s = 0; s < count; ++s) {
    if (s_.parent[size(s)] != kInvalid) child_[size(next[size(s_.parent[size(s)])]++)] = s;
  }
  plan_entries(column, row, context);
  context.check();
  plan_tasks();
}

double Multifrontal::front_flops(Index s) const {
  const double c = width(s);
  const double r = below(s);
  return c * c * c / 3 + c * c * r + c * r * r +
         1e3;  // the constant stands for the overhead of a front
}

// Lists, per supernode, which values go where in its panel. Counting sort by supernode.
void Multifrontal::plan_entries(const Index* column, const Index* row,
                                const ExecutionContext& context) {
  const auto place = [&](Index unknown) {
    return block_ * s_.position[size(unknown / block_)] + unknown % block_;
  };
  const auto supernode = [&](Index at) { return s_.of_column[size(at / block_)]; };
  entry_begin_.assign(size(s_.count()) + 1, 0);
  std::int64_t total = 0;
  for (Index j = 0; j < size_; ++j) {
    if (j % 65536 == 0) context.check();
    const Index pj = place(j);
    for (Index e = column[j]; e < column[j + 1]; ++e) {
      if (row[e] < j) continue;
      ++entry_begin_[size(supernode(std::min(pj, place(row[e])))) + 1];
      ++total;
    }
  }
  context.check();
  std::partial_sum(entry_begin_.begin(), entry_begin_.end(), entry_begin_.begin());
  entry_source_.resize(size(total));
  entry_target_.resize(size(total));
  std::vector<Index> lower(size(total));
  std::vector<std::int64_t> next(entry_begin_.begin(), entry_begin_.end() - 1);
  for (Index j = 0; j < size_; ++j) {
    if (j % 65536 == 0) context.check();
    const Index pj = place(j);
    for (Index e = column[j]; e < column[j + 1]; ++e) {
      if (row[e] < j) continue;
      const Index low = std::min(pj, place(row[e]));
      const Index s = supernode(low);
      const std::int64_t slot = next[size(s)]++;
      entry_source_[size(slot)] = e;
      lower[size(slot)] = low;
      // For now the higher place; turned into an offset below, where the front's rows are at hand.
      entry_target_[size(slot)] = std::max(pj, place(row[e]));
    }
  }
  context.check();
  parallel_for(
      context, size(s_.count()), 4096, [&](std::size_t begin, std::size_t end, std::size_t) {
        for (std::size_t n = begin; n < end; ++n) {
          const auto s = static_cast<Index>(n);
          const Index first = s_.first[n];
          const Index last = s_.first[n + 1];
          const auto rows_begin = s_.rows.begin() + s_.rows_begin[n];
          const auto rows_end = s_.rows.begin() + s_.rows_begin[n + 1];
          const std::int64_t ld = width(s) + below(s);
          for (std::int64_t slot = entry_begin_[n]; slot < entry_begin_[n + 1]; ++slot) {
            const Index low = lower[size(slot)];
            const Index high = entry_target_[size(slot)];
            const Index vertex = high / block_;
            const Index in_front =
                vertex < last
                    ? vertex - first
                    : s_.columns(s) +
                          static_cast<Index>(std::lower_bound(rows_begin, rows_end, vertex) -
                                             rows_begin);
            entry_target_[size(slot)] = static_cast<Index>((low - wide(block_) * first) * ld +
                                                           wide(block_) * in_front + high % block_);
          }
        }
      });
}

// Cuts the forest into subtrees that threads can take whole: the costliest is opened until none is
// too large.
void Multifrontal::plan_tasks() {
  const Index count = s_.count();
  std::vector<double> flops(size(count), 0.0);
  std::vector<Index> begin(size(count));
  for (Index s = 0; s < count; ++s) begin[size(s)] = s;
  for (Index s = 0; s < count; ++s) {
    flops[size(s)] += front_flops(s);
    const Index p = s_.parent[size(s)];
    if (p == kInvalid) continue;
    flops[size(p)] += flops[size(s)];
    begin[size(p)] = std::min(begin[size(p)], begin[size(s)]);
  }
  const double most = std::max(kLeastTask, total_flops_ * kTaskShare);
  std::priority_queue<std::pair<double, Index>> open;
  for (Index s = 0; s < count; ++s) {
    if (s_.parent[size(s)] == kInvalid) open.emplace(flops[size(s)], s);
  }
  while (!open.empty()) {
    const auto [cost, s] = open.top();
    open.pop();
    if (cost <= most) {
      tasks_.push_back({begin[size(s)], s, cost, 0, 0});
      continue;
    }
    top_.push_back(s);
    for (Index c = child_begin_[size(s)]; c < child_begin_[size(s) + 1]; ++c) {
      open.emplace(flops[size(child_[size(c)])], child_[size(c)]);
    }
  }
  std::sort(top_.begin(), top_.end());
  task_of_.assign(size(count), kInvalid);
  inside_.resize(size(count));
  for (Index s = 0; s < count; ++s) inside_[size(s)] = s_.rows_below(s);
  target_ = s_.rows;
  std::vector<Index> members;
  for (std::size_t t = 0; t < tasks_.size(); ++t) {
    Task& task = tasks_[t];
    task_of_[size(task.root)] = static_cast<Index>(t);
    task.update = handed_size_;
    handed_size_ += wide(below(task.root)) * below(task.root);
    task.outside = outside_size_;
    outside_size_ += below(task.root);
    members.resize(size(task.root - task.begin + 1));
    std::iota(members.begin(), members.end(), task.begin);
    task_stack_ = std::max(task_stack_, stack_need(members));
    plan_outside(task);
  }
  top_stack_ = stack_need(top_);
}

// Rows past the task, of the supernodes in it, are rows of its root's front: their places there.
void Multifrontal::plan_outside(const Task& task) {
  const Index end = s_.first[size(task.root) + 1];
  const auto root_begin = s_.rows.begin() + s_.rows_begin[size(task.root)];
  const auto root_end = s_.rows.begin() + s_.rows_begin[size(task.root) + 1];
  for (Index s = task.begin; s <= task.root; ++s) {
    const auto begin = s_.rows_begin[size(s)];
    auto i = s_.rows_begin[size(s) + 1];
    auto at = root_end;  // both lists ascend
    for (; i > begin && s_.rows[size(i - 1)] >= end; --i) {
      while (at != root_begin && *(at - 1) >= s_.rows[size(i - 1)]) --at;
      target_[size(i - 1)] = static_cast<Index>(at - root_begin);
    }
    inside_[size(s)] = static_cast<Index>(i - begin);
  }
}

// Doubles that the stack of update matrices holds at its fullest. Children that are task roots are
// not on it.
std::int64_t Multifrontal::stack_need(const std::vector<Index>& supernodes) const {
  std::int64_t now = 0;
  std::int64_t most = 0;
  for (const Index s : supernodes) {
    const std::int64_t own = wide(below(s)) * below(s);
    most = std::max(most, now + own);
    now += own;
    for (Index c = child_begin_[size(s)]; c < child_begin_[size(s) + 1]; ++c) {
      const Index child = child_[size(c)];
      if (task_of_[size(child)] == kInvalid) now -= wide(below(child)) * below(child);
    }
  }
  return most;
}

void Multifrontal::assemble_panel(Index s, const double* values, double* panel) const {
  std::fill(panel, panel + (panel_[size(s) + 1] - panel_[size(s)]), 0.0);
  for (std::int64_t e = entry_begin_[size(s)]; e < entry_begin_[size(s) + 1]; ++e) {
    panel[entry_target_[size(e)]] += values[entry_source_[size(e)]];
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
  const Index parent = s_.parent[size(child)];
  const std::int64_t ld_child = below(child);
  const std::int64_t ld = width(parent) + below(parent);
  const Index* relative = s_.relative.data() + s_.rows_begin[size(child)];
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
  const Index parent = s_.parent[size(child)];
  const std::int64_t ld_child = below(child);
  const std::int64_t ld = below(parent);
  const Index* relative = s_.relative.data() + s_.rows_begin[size(child)];
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
  double* panel = factor_ + panel_[size(s)];
  assemble_panel(s, values, panel);
  const Index children_begin = child_begin_[size(s)];
  const Index children_end = child_begin_[size(s) + 1];
  Index on_stack = 0;
  for (Index c = children_begin; c < children_end; ++c) {
    if (task_of_[size(child_[size(c)])] == kInvalid) ++on_stack;
  }
  std::size_t next = stack.updates.size() - size(on_stack);
  const std::size_t first = next;
  const auto update_of = [&](Index child) {
    const Index task = task_of_[size(child)];
    if (task != kInvalid)
      return static_cast<const double*>(memory_.handed.get() + tasks_[size(task)].update);
    return static_cast<const double*>(stack.base + stack.updates[next++].second);
  };
  for (Index c = children_begin; c < children_end; ++c) {
    const Index child = child_[size(c)];
    add_to_panel(child, update_of(child), panel, parallel);
  }
  if (!factor_panel(s, panel, parallel)) return false;

  const std::int64_t own = wide(below(s)) * below(s);
  double* update = stack.base + stack.top;
  if (own > 0) {
    form_update(s, panel, update, parallel);
    next = first;
    for (Index c = children_begin; c < children_end; ++c) {
      const Index child = child_[size(c)];
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
  dense::use_one_thread();
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
