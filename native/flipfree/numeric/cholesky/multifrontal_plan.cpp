// What a factorization can know before it has seen a number: places of entries, subtrees for the
// threads, memory.
#include <algorithm>
#include <numeric>
#include <queue>
#include <utility>

#include "flipfree/base/parallel.h"
#include "flipfree/numeric/cholesky/multifrontal.h"

namespace flipfree::numeric {
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
  child_begin_.assign(at(count) + 1, 0);
  for (Index s = 0; s < count; ++s) {
    const std::int64_t c = width(s);
    const std::int64_t r = below(s);
    panel_.push_back(panel_.back() + c * (c + r));
    factor_nonzeros_ += c * (c + 1) / 2 + c * r;
    total_flops_ += front_flops(s);
    widest_below_ = std::max(widest_below_, below(s));
    if (s_.parent[at(s)] != kInvalid) ++child_begin_[at(s_.parent[at(s)]) + 1];
  }
  std::partial_sum(child_begin_.begin(), child_begin_.end(), child_begin_.begin());
  child_.resize(at(child_begin_.back()));
  std::vector<Index> next(child_begin_.begin(), child_begin_.end() - 1);
  for (Index s = 0; s < count; ++s) {
    if (s_.parent[at(s)] != kInvalid) child_[at(next[at(s_.parent[at(s)])]++)] = s;
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
    return block_ * s_.position[at(unknown / block_)] + unknown % block_;
  };
  const auto supernode = [&](Index unknown) { return s_.of_column[at(unknown / block_)]; };
  entry_begin_.assign(at(s_.count()) + 1, 0);
  std::int64_t total = 0;
  for (Index j = 0; j < size_; ++j) {
    if (j % 65536 == 0) context.check();
    const Index pj = place(j);
    for (Index e = column[j]; e < column[j + 1]; ++e) {
      if (row[e] < j) continue;
      ++entry_begin_[at(supernode(std::min(pj, place(row[e])))) + 1];
      ++total;
    }
  }
  context.check();
  std::partial_sum(entry_begin_.begin(), entry_begin_.end(), entry_begin_.begin());
  entry_source_.resize(at(total));
  entry_target_.resize(at(total));
  std::vector<Index> lower(at(total));
  std::vector<std::int64_t> next(entry_begin_.begin(), entry_begin_.end() - 1);
  for (Index j = 0; j < size_; ++j) {
    if (j % 65536 == 0) context.check();
    const Index pj = place(j);
    for (Index e = column[j]; e < column[j + 1]; ++e) {
      if (row[e] < j) continue;
      const Index low = std::min(pj, place(row[e]));
      const Index s = supernode(low);
      const std::int64_t slot = next[at(s)]++;
      entry_source_[at(slot)] = e;
      lower[at(slot)] = low;
      // For now the higher place; turned into an offset below, where the front's rows are at hand.
      entry_target_[at(slot)] = std::max(pj, place(row[e]));
    }
  }
  context.check();
  parallel_for(context, at(s_.count()), 4096, [&](std::size_t begin, std::size_t end, std::size_t) {
    for (std::size_t n = begin; n < end; ++n) {
      const auto s = static_cast<Index>(n);
      const Index first = s_.first[n];
      const Index last = s_.first[n + 1];
      const auto rows_begin = s_.rows.begin() + s_.rows_begin[n];
      const auto rows_end = s_.rows.begin() + s_.rows_begin[n + 1];
      const std::int64_t ld = width(s) + below(s);
      for (std::int64_t slot = entry_begin_[n]; slot < entry_begin_[n + 1]; ++slot) {
        const Index low = lower[at(slot)];
        const Index high = entry_target_[at(slot)];
        const Index vertex = high / block_;
        const Index in_front =
            vertex < last
                ? vertex - first
                : s_.columns(s) + static_cast<Index>(
                                      std::lower_bound(rows_begin, rows_end, vertex) - rows_begin);
        entry_target_[at(slot)] = static_cast<Index>((low - wide(block_) * first) * ld +
                                                     wide(block_) * in_front + high % block_);
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
  for (Index s = 0; s < count; ++s) {
    if (s_.parent[at(s)] == kInvalid) open.emplace(flops[at(s)], s);
  }
  while (!open.empty()) {
    const auto [cost, s] = open.top();
    open.pop();
    if (cost <= most) {
      tasks_.push_back({begin[at(s)], s, cost, 0, 0});
      continue;
    }
    top_.push_back(s);
    for (Index c = child_begin_[at(s)]; c < child_begin_[at(s) + 1]; ++c) {
      open.emplace(flops[at(child_[at(c)])], child_[at(c)]);
    }
  }
  std::sort(top_.begin(), top_.end());
  task_of_.assign(at(count), kInvalid);
  inside_.resize(at(count));
  for (Index s = 0; s < count; ++s) inside_[at(s)] = s_.rows_below(s);
  target_ = s_.rows;
  std::vector<Index> members;
  for (std::size_t t = 0; t < tasks_.size(); ++t) {
    Task& task = tasks_[t];
    task_of_[at(task.root)] = static_cast<Index>(t);
    task.update = handed_size_;
    handed_size_ += wide(below(task.root)) * below(task.root);
    task.outside = outside_size_;
    outside_size_ += below(task.root);
    members.resize(at(task.root - task.begin + 1));
    std::iota(members.begin(), members.end(), task.begin);
    task_stack_ = std::max(task_stack_, stack_need(members));
    plan_outside(task);
  }
  top_stack_ = stack_need(top_);
}

// Rows past the task, of the supernodes in it, are rows of its root's front: their places there.
void Multifrontal::plan_outside(const Task& task) {
  const Index end = s_.first[at(task.root) + 1];
  const auto root_begin = s_.rows.begin() + s_.rows_begin[at(task.root)];
  const auto root_end = s_.rows.begin() + s_.rows_begin[at(task.root) + 1];
  for (Index s = task.begin; s <= task.root; ++s) {
    const auto begin = s_.rows_begin[at(s)];
    auto i = s_.rows_begin[at(s) + 1];
    auto row = root_end;  // both lists ascend
    for (; i > begin && s_.rows[at(i - 1)] >= end; --i) {
      while (row != root_begin && *(row - 1) >= s_.rows[at(i - 1)]) --row;
      target_[at(i - 1)] = static_cast<Index>(row - root_begin);
    }
    inside_[at(s)] = static_cast<Index>(i - begin);
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
    for (Index c = child_begin_[at(s)]; c < child_begin_[at(s) + 1]; ++c) {
      const Index child = child_[at(c)];
      if (task_of_[at(child)] == kInvalid) now -= wide(below(child)) * below(child);
    }
  }
  return most;
}

}  // namespace flipfree::numeric
