// Numeric phase of the supernodal Cholesky factorization: multifrontal (Duff, Reid 1983; Liu 1992),
// in parallel over subtrees of the elimination tree and, above them, over tiles of the fronts. How
// work is split depends on the matrix only, never on the number of threads, so the factor has the
// same bits for any number.
//
//   front of a supernode:   columns c   rows r         children's updates are added into [A11 A21
//   U] at their
//                         c [ A11  .  ]                relative places, then A11 = L11 L11', L21 =
//                         A21 L11^-T, r [ A21  U  ]                U -= L21 L21' is the update for
//                         the parent.
#pragma once

#include <cstdint>
#include <memory>
#include <mutex>
#include <new>
#include <utility>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/numeric/cholesky/symbolic_cholesky.h"

namespace flipfree::numeric {

// Products of indices are taken in 64 bits.
constexpr std::int64_t wide(Index i) { return i; }

// Memory that one factorization hands to the next: fresh pages cost as much as filling them.
struct DoubleBuffer {
  // Where sums of vectors of numbers begin depends on this, and with it last bits.
  static constexpr std::align_val_t kAlignment{64};
  struct Free {
    void operator()(double* doubles) const { ::operator delete(doubles, kAlignment); }
  };
  // At least `size` doubles; what they were is lost when that is more than before.
  double* provide(std::int64_t size);

  std::unique_ptr<double, Free> data;
  std::int64_t capacity = 0;
};
struct FactorMemory {
  DoubleBuffer factor;
  DoubleBuffer handed;             // updates of the tasks' roots
  DoubleBuffer top;                // stack of the supernodes above all tasks
  std::vector<DoubleBuffer> idle;  // stacks of tasks
};

class Multifrontal {
 public:
  // block: scalars per vertex of the graph. column, row: lower triangle of the scalar pattern
  // (entries above the diagonal are skipped), unknown block * v + k belongs to vertex v.
  Multifrontal(Supernodes supernodes, Index block, Index size, const Index* column,
               const Index* row, const ExecutionContext& context, FactorMemory memory = {});
  // Ends the use of this one.
  FactorMemory take_memory() { return std::move(memory_); }

  // False if a pivot is not positive. Reports progress over the context's current range; checks for
  // cancel after every front or tile (some milliseconds).
  bool factorize(const double* values, ExecutionContext& context);

  // In place: rhs is size x count, column-major.
  void solve(double* rhs, Index count, const ExecutionContext& context) const;

 private:
  // A subtree that one thread handles alone: supernodes [begin, root], contiguous in postorder.
  struct Task {
    Index begin = 0;
    Index root = 0;
    std::int64_t update = 0;  // where its root's update matrix goes in handed_
  };
  // Where the update matrices of one run live, and where each child's is.
  struct Stack;

  Index width(Index s) const { return block_ * s_.columns(s); }
  Index below(Index s) const { return block_ * s_.rows_below(s); }
  void plan_entries(const Index* column, const Index* row, const ExecutionContext& context);
  void plan_tasks();
  double front_flops(Index s) const;
  std::int64_t stack_need(const std::vector<Index>& supernodes) const;
  void assemble_panel(Index s, const double* values, double* panel) const;
  void add_child(Index child, const double* update, bool in_panel, double* target,
                 const ExecutionContext* parallel) const;
  bool eliminate(Index s, const double* values, Stack& stack, const ExecutionContext* parallel);
  bool factor_panel(Index s, double* panel, const ExecutionContext* parallel) const;
  void form_update(Index s, const double* panel, double* update,
                   const ExecutionContext* parallel) const;
  void advance(double flops, ExecutionContext& context);
  template <typename Visit>
  void for_below(Index s, Index count, const Visit& visit) const;
  void forward(Index s, double* x, Index count, double* work) const;
  void backward(Index s, double* x, Index count, double* work) const;
  void permute(double* rhs, double* x, Index count, bool back) const;

  Supernodes s_;
  Index block_;
  Index size_;
  std::vector<std::int64_t> panel_;  // supernode -> start of its panel in factor_
  FactorMemory memory_;
  double* factor_ = nullptr;
  // An entry of the matrix: its index in the values, and its place in the panel.
  struct Entry {
    Index source, target;
  };
  Lists<Entry> entries_;        // of each supernode's panel
  std::vector<Task> tasks_;     // by falling cost
  std::vector<Index> task_of_;  // supernode -> task whose root it is, or kInvalid
  std::vector<Index> top_;      // supernodes above all tasks, ascending
  std::int64_t handed_size_ = 0;
  std::int64_t task_stack_ = 0;  // doubles
  std::int64_t top_stack_ = 0;
  std::mutex stacks_mutex_;
  Index widest_below_ = 0;
  double total_flops_ = 0;
  std::mutex progress_mutex_;
  double done_flops_ = 0;
};

}  // namespace flipfree::numeric
