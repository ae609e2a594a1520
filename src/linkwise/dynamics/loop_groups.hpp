#pragma once
// Loops and couplings that are eliminated together: those that share a body on their way inward. A
// group is eliminated at its top, the innermost body at which paths of its loops meet, or at the
// ground. There nothing but a change of that body's articulated inertia is left of it.
#include <vector>

#include "linkwise/kinematics/loop_states.hpp"

namespace linkwise {

struct LoopGroup {
  /// Unit forces on one body: rows of the group, in columns [first, first + rows.size()) of all.
  struct Carrier {
    int body;
    std::vector<int> rows;
    int first;
    std::vector<int> to;  ///< column at the parent that each adds to, or -1 - row: at the top
    /// Of a body whose own coordinates carry a port: how many, and the first of their parts of unit
    /// forces, [rows][own], among those of all carriers.
    int own = 0, own_first = 0;
    int elastic = -1;  ///< of a body on a port: the carrier that is its parent
  };
  /// A loop joint or a coupling: its rows [row, row + n_rows), and the columns, or -1 - row, where
  /// its forces act. Those of a joint are on its parent and its child, those of a coupling on the
  /// body of each term, or on both where its joint closes a loop.
  struct Member {
    int loop = -1, coupling = -1;  ///< one of them
    int row = 0, n_rows = 0;
    std::vector<int> at;
  };

  int top = -1;
  int rows = 0, columns = 0;
  int own = 0;     ///< parts of unit forces along coordinates of bodies' own
  int rotors = 0;  ///< how many of the rows are those of rotors, which hold nothing
  std::vector<Member> members;
  std::vector<Carrier> carriers;  ///< tip to base
};

/// Bodies that carry the forces of a member inward to the top of its group, ascending.
std::vector<int> bodies_of(const Model& model, const LoopGroup::Member& member, int top);
/// Outermost tops first, the ground's group last.
std::vector<LoopGroup> make_loop_groups(const Model& model);
/// Columns and carriers of a group whose members have their rows.
void add_carriers(const Model& model, LoopGroup& group);
/// The same without columns and carriers.
std::vector<LoopGroup> outline_loop_groups(const Model& model);

}  // namespace linkwise
