#include "flipfree/numeric/cholesky/multifrontal.h"

#include <algorithm>
#include <atomic>
#include <numeric>
#include <queue>
#include <utility>
#include <vector>

#include "flipfree/base/parallel.h"
#include "flipfree/numeric/dense_kernels.h"

namespace flipfree::numeric {

namespace {

// benchmarks/cholesky_benchmark.cpp measures them.
constexpr Index kPanelWidth = 64;   // columns eliminated at once in a front
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
  if (size > capacity) {
    // Some more, since the next factor will be a little different. Untouched pages cost nothing.
    const std::int64_t some = size + size / 4;
    *this = {};
    data.reset(static_cast<double*>(::operator new(at(some) * sizeof(double), kAlignment)));
    capacity = some;
  }
  return data.get();
}

struct Multifrontal::Stack {
  double* base = nullptr;
  std::int64_t top = 0;
  std::vector<std::pair<Index, std::int64_t>>
      updates;  // supernode, place; the last ones are the next children
};

void Multifrontal::assemble_panel(Index s, const double* values, double* panel) const {
  std::fill(panel, panel + (panel_[at(s) + 1] - panel_[at(s)]), 0.0);
  for (const Entry& entry : entries_[s]) panel[entry.target] += values[entry.source];
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

// Adds the part of a child's update that lies in its parent's panel, or that below it, in the
// parent's update. Above the diagonal, within diagonal blocks, updates hold nothing of meaning and
// neither does their sum.
void Multifrontal::add_child(Index child, const double* update, bool in_panel, double* target,
                             const ExecutionContext* parallel) const {
  const Index parent = s_.parent[at(child)];
  const Index* relative = s_.relative.data() + s_.rows_begin[at(child)];
  const Index rows = s_.rows_below(child);
  const Index columns = s_.columns(parent);
  const auto split =
      static_cast<Index>(std::lower_bound(relative, relative + rows, columns) - relative);
  // Relative rows count from the top of the parent's front; its update starts below the columns.
  const Index top = in_panel ? 0 : columns;
  const Index first = in_panel ? 0 : split;
  const std::int64_t ld = below(parent) + (in_panel ? width(parent) : 0);
  tiles(parallel, in_panel ? split : rows - split, kTile, [&](Index begin, Index end) {
    for (Index j = first + begin; j < first + end; ++j) {
      for (Index k = 0; k < block_; ++k) {
        add_column(update + (wide(block_) * j + k) * below(child), relative, j, rows, block_,
                   target + (wide(block_) * (relative[j] - top) + k) * ld - wide(block_) * top);
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
    if (k > 0) dense::kernels().subtract_square(w, k, panel + k, f, diagonal, f);
    if (!dense::kernels().cholesky(w, diagonal, f)) return false;
    const Index rest = f - k - w;
    tiles(parallel, rest, kTile, [&](Index begin, Index end) {
      double* rows = panel + k * ld + k + w + begin;
      if (k > 0)
        dense::kernels().subtract_product(end - begin, w, k, panel + k + w + begin, f, panel + k, f,
                                          rows, f);
      dense::kernels().solve_right_transposed(end - begin, w, diagonal, f, rows, f);
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
    const Index rows = std::min(kTile, r - row);
    const Index columns = std::min(kTile, r - column);
    for (Index k = 0; k < columns; ++k) {
      double* top = target + wide(k) * r;
      std::fill(top + (i == pair ? k : 0), top + rows, 0.0);
    }
    if (i == pair) {
      dense::kernels().subtract_square(rows, c, l + row, f, target, r);
    } else {
      dense::kernels().subtract_product(rows, columns, c, l + row, f, l + column, f, target, r);
    }
  });
}

// One front: assemble, eliminate, leave the update on the stack in place of the children's.
bool Multifrontal::eliminate(Index s, const double* values, Stack& stack,
                             const ExecutionContext* parallel) {
  if (parallel != nullptr && front_flops(s) < kTileFlops) parallel = nullptr;
  double* panel = factor_ + panel_[at(s)];
  assemble_panel(s, values, panel);
  const auto on_stack = std::count_if(s_.children[s].begin(), s_.children[s].end(),
                                      [&](Index child) { return task_of_[at(child)] == kInvalid; });
  const std::size_t first = stack.updates.size() - static_cast<std::size_t>(on_stack);
  std::size_t next = first;
  const auto update_of = [&](Index child) -> const double* {
    const Index task = task_of_[at(child)];
    if (task != kInvalid) return memory_.handed.data.get() + tasks_[at(task)].update;
    return stack.base + stack.updates[next++].second;
  };
  for (const Index child : s_.children[s])
    add_child(child, update_of(child), true, panel, parallel);
  if (!factor_panel(s, panel, parallel)) return false;

  const std::int64_t own = wide(below(s)) * below(s);
  double* update = stack.base + stack.top;
  if (own > 0) {
    form_update(s, panel, update, parallel);
    next = first;
    for (const Index child : s_.children[s])
      add_child(child, update_of(child), false, update, parallel);
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
      std::copy(memory.data.get(), memory.data.get() + own,
                memory_.handed.data.get() + task.update);
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

// What a factorization can know before it has seen a number: places of entries, subtrees for the
// threads, memory.

namespace {

// benchmarks/cholesky_benchmark.cpp measures them.
constexpr double kTaskShare =
    1.0 / 24;                       // no subtree task may cost more than this share of everything
constexpr double kLeastTask = 2e6;  // flops; smaller subtrees are not split off

}  // namespace

Multifrontal::Multifrontal(Supernodes supernodes, Index block, Index size_, const Index* column,
                           const Index* row, const ExecutionContext& context, FactorMemory memory)
    : s_(std::move(supernodes)), block_(block), size_(size_), memory_(std::move(memory)) {
  const Index count = s_.count();
  panel_.assign(1, 0);
  for (Index s = 0; s < count; ++s) {
    panel_.push_back(panel_.back() + wide(width(s)) * (width(s) + below(s)));
    total_flops_ += front_flops(s);
    widest_below_ = std::max(widest_below_, below(s));
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

// Lists, per supernode, which values go where in its panel.
void Multifrontal::plan_entries(const Index* column, const Index* row,
                                const ExecutionContext& context) {
  const auto place = [&](Index unknown) {
    return block_ * s_.position[at(unknown / block_)] + unknown % block_;
  };
  // First the later of an entry's two places. It becomes one in the panel where the front's rows
  // are at hand.
  entries_ = Lists<Entry>(at(s_.count()), [&](const auto& add) {
    for (Index j = 0; j < size_; ++j) {
      if (j % 65536 == 0) context.check();
      for (Index e = column[j]; e < column[j + 1]; ++e) {
        if (row[e] < j) continue;
        const auto [low, high] = std::minmax({place(j), place(row[e])});
        add(s_.of_column[at(low / block_)], {e, high});
      }
    }
  });
  std::vector<Index> column_of(at(column[size_]));  // of each value
  for (Index j = 0; j < size_; ++j)
    std::fill(column_of.begin() + column[j], column_of.begin() + column[j + 1], j);
  parallel_for(context, at(s_.count()), 4096, [&](std::size_t begin, std::size_t end, std::size_t) {
    for (std::size_t n = begin; n < end; ++n) {
      const auto s = static_cast<Index>(n);
      const Index first = s_.first[n];
      const auto rows_begin = s_.rows.begin() + s_.rows_begin[n];
      const auto rows_end = s_.rows.begin() + s_.rows_begin[n + 1];
      const std::int64_t ld = width(s) + below(s);
      for (Entry& entry : entries_[s]) {
        const Index low = std::min(place(column_of[at(entry.source)]), place(row[entry.source]));
        const Index vertex = entry.target / block_;
        const Index in_front =
            vertex < s_.first[n + 1]
                ? vertex - first
                : s_.columns(s) + static_cast<Index>(
                                      std::lower_bound(rows_begin, rows_end, vertex) - rows_begin);
        entry.target = static_cast<Index>((low - wide(block_) * first) * ld +
                                          wide(block_) * in_front + entry.target % block_);
      }
    }
  });
}

// Cuts the forest into subtrees that threads can take whole: the costliest is opened until none is
// too large.
void Multifrontal::plan_tasks() {
  const Index count = s_.count();
  std::vector<double> flops(at(count), 0.0);
  std::vector<Index> begin(at(count));
  for (Index s = 0; s < count; ++s) begin[at(s)] = s;
  for (Index s = 0; s < count; ++s) {
    flops[at(s)] += front_flops(s);
    const Index p = s_.parent[at(s)];
    if (p == kInvalid) continue;
    flops[at(p)] += flops[at(s)];
    begin[at(p)] = std::min(begin[at(p)], begin[at(s)]);
  }
  const double most = std::max(kLeastTask, total_flops_ * kTaskShare);
  std::priority_queue<std::pair<double, Index>> open;
  for (const Index root : s_.children[count]) open.emplace(flops[at(root)], root);
  while (!open.empty()) {
    const auto [cost, s] = open.top();
    open.pop();
    if (cost <= most) {
      tasks_.push_back({begin[at(s)], s});
      continue;
    }
    top_.push_back(s);
    for (const Index child : s_.children[s]) open.emplace(flops[at(child)], child);
  }
  std::sort(top_.begin(), top_.end());
  task_of_.assign(at(count), kInvalid);
  std::vector<Index> members;
  for (std::size_t t = 0; t < tasks_.size(); ++t) {
    Task& task = tasks_[t];
    task_of_[at(task.root)] = static_cast<Index>(t);
    task.update = handed_size_;
    handed_size_ += wide(below(task.root)) * below(task.root);
    members.resize(at(task.root - task.begin + 1));
    std::iota(members.begin(), members.end(), task.begin);
    task_stack_ = std::max(task_stack_, stack_need(members));
  }
  top_stack_ = stack_need(top_);
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
    for (const Index child : s_.children[s]) {
      if (task_of_[at(child)] == kInvalid) now -= wide(below(child)) * below(child);
    }
  }
  return most;
}

// Multifrontal: solving with the factor.

// visit(place in x, place in work) for the rows below s, of all right-hand sides.
template <typename Visit>
void Multifrontal::for_below(Index s, Index count, const Visit& visit) const {
  const Index* rows = s_.rows.data() + s_.rows_begin[at(s)];
  for (Index k = 0; k < count; ++k) {
    for (Index i = 0; i < s_.rows_below(s); ++i) {
      for (Index b = 0; b < block_; ++b)
        visit(wide(k) * size_ + wide(block_) * rows[i] + b,
              wide(k) * below(s) + wide(block_) * i + b);
    }
  }
}

// x of the supernode's columns is solved; its rows below are updated.
void Multifrontal::forward(Index s, double* x, Index count, double* work) const {
  const Index c = width(s), r = below(s);
  const double* panel = factor_ + panel_[at(s)];
  double* own = x + wide(block_) * s_.first[at(s)];
  dense::kernels().solve_left(c, count, panel, c + r, own, size_);
  if (r == 0) return;
  dense::kernels().product(r, c, count, panel + c, c + r, own, size_, work, r);
  for_below(s, count, [&](std::int64_t to, std::int64_t from) { x[to] -= work[from]; });
}

void Multifrontal::backward(Index s, double* x, Index count, double* work) const {
  const Index c = width(s), r = below(s);
  const double* panel = factor_ + panel_[at(s)];
  double* own = x + wide(block_) * s_.first[at(s)];
  for_below(s, count, [&](std::int64_t from, std::int64_t to) { work[to] = x[from]; });
  if (r > 0)
    dense::kernels().subtract_transposed_product(r, c, count, panel + c, c + r, work, r, own,
                                                 size_);
  dense::kernels().solve_left_transposed(c, count, panel, c + r, own, size_);
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

// On this thread alone: it takes a twentieth of what the factorization does.
void Multifrontal::solve(double* rhs, Index count, const ExecutionContext& context) const {
  DoubleBuffer own, work;
  double* const x = own.provide(wide(size_) * count);
  work.provide(wide(widest_below_) * count);
  permute(rhs, x, count, false);
  for (Index s = 0; s < s_.count(); ++s) {
    if (s % 256 == 0) context.check();
    forward(s, x, count, work.data.get());
  }
  for (Index s = s_.count(); s-- > 0;) {
    if (s % 256 == 0) context.check();
    backward(s, x, count, work.data.get());
  }
  permute(rhs, x, count, true);
}

}  // namespace flipfree::numeric
