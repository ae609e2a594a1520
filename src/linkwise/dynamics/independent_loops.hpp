#pragma once
// Closed loops by those of their constraints that are independent wherever the machine is. A hinge
// that closes a planar loop holds five directions, of which the plane leaves two: which they are is
// found once, and accelerations then come of two unit forces instead of five. Nothing is taken on
// trust. A state where the chosen rows are nearly dependent, or where accelerations that keep them
// break one that was left out, is not answered here (ArticulatedLoops takes all rows then, and
// always for loads, which are shared among all).
// With Lambda = U^T D^-1 U of a group, and V = [Psi, r - beta] swept by U^-T,
//     Y_top += sum V_k V_k^T / d_k
// and no matrix is inverted. Unit forces go inward in lanes, side by side.
#include <array>
#include <vector>

#include "linkwise/dynamics/loop_groups.hpp"
#include "linkwise/dynamics/loop_wrenches.hpp"
#include "linkwise/linear/upper_rows.hpp"
#include "linkwise/recursion/tree_sweeps.hpp"

namespace linkwise {

class IndependentLoops {
 public:
  using Wide = UpperRows::Wide;
  /// taken: of each group its rows. No group may have couplings. All must outlive this.
  IndependentLoops(const Model& model, const std::vector<LoopGroup>& groups,
                   const std::vector<std::vector<char>>& taken, const LoopMetric& metric);

  int rows(int g) const { return groups_[g].rows; }

  /// Lambda, Psi and beta of a group. Everything outboard of its top is eliminated.
  void carry(const TreeSweeps<double>& sweeps, const SweepInput<double>& in,
             const LoopStates& states, int g);
  /// False where some pivot is below `least` of what the bodies yield to its row, each alone.
  bool factor(int g, double least);
  /// The least of these parts, over the largest, of the last factor.
  double smallest_pivot(int g) const { return work_[g].smallest; }
  /// What the group leaves on its top.
  Contribution<double> reduce_top(int g);
  /// Forces from the acceleration of the top, and what they do to the joints on the paths.
  void solve(TreeSweeps<double>& sweeps, int g, const Motion<double>& top);
  /// By how much the rows that were left out miss, over accelerations; 0 where none were.
  double missed(const TreeSweeps<double>& sweeps, const LoopStates& states,
                const Motion<double>& ground) const;

 private:
  static constexpr int width = UpperRows::width;
  using Column = LoopColumn<Wide>;
  struct Carrier {
    int body, first, count;  ///< columns: lanes from first * width on
    int most_z;              ///< columns that the joint may have
    std::vector<int> rows;
    bool in_a_row;
    /// Lane at the parent that each adds to, or -1 - row: at the top. aligned: as they stand, from
    /// the lanes of this column on; else -1.
    std::vector<int> to;
    int aligned;
  };
  /// Rows of a loop joint from `begin` on, in lanes: their directions, the wrenches on the child,
  /// and what that yields to them. Those of most joints are constants.
  struct Block {
    int begin, count;
    bool known = false;
    Force<Wide> Q{}, on_b{};
    Wide yields{};
  };
  struct Member {
    int loop, row;
    std::vector<int> kept;  ///< of the loop's rows
    int at[2];              ///< lanes or -1 - row, as above
    std::vector<Block> blocks;
  };
  struct Group {
    int top = -1, rows = 0;
    std::vector<Member> members;
    std::vector<Carrier> carriers;
  };
  struct Work {
    UpperRows Lambda;
    std::vector<Column> columns;
    std::vector<Force<double>> Psi;
    std::vector<double> beta, r, f, size;  ///< size: what the bodies yield, each alone
    std::vector<std::array<double, 8>> V;
    double smallest = 1;
  };

  Group reduced(const LoopGroup& group, const std::vector<char>& taken);
  Work work_of(const Group& group) const;
  void set_directions(const LoopState& loop, int l, const Member& member, Block& block) const;
  void place(const LoopStates& states, Member& member, Work& w) const;
  void add(int at, int count, const Force<Wide>& F, Work& w) const;
  void add_products(const Carrier& carrier, int dof, Work& w) const;
  void pass_on(const Carrier& carrier, Work& w) const;

  const Model& model_;
  const LoopMetric& metric_;
  std::vector<Group> groups_;
  std::vector<Work> work_;
  std::vector<std::vector<int>> dropped_;  ///< by loop
  std::vector<double> z_, y_;              ///< of a carrier: [columns of the joint][columns]
};

}  // namespace linkwise
