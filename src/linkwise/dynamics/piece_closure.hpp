#pragma once
// Joints that close loops on a chain in pieces (piecewise.hpp). Each pushes on bodies that end a
// piece, beside the outboard cut joint. With w the six components of its unit force there, as the
// cut joint's frame sees them, and K w what they ask of the cut system,
//     F = A^-1 K,   Lambda = sum over pieces (Q F_s - Psi w_s)^T J (Q F_s - Psi w_s) + w_s^T
//     Lambda_s w_s
// where w_s holds F of the outboard cut, too. That is twice the kinetic energy of unit forces. As a
// sum of squares it is zero to rounding in directions that other constraints hold already, which a
// Schur complement of A is not. Lambda f = r - (what the chain does without f) is then solved as in
// the recursion (loop_system.hpp), and the cut forces change by F f.
#include <optional>
#include <span>
#include <vector>

#include "linkwise/dynamics/chain_pieces.hpp"
#include "linkwise/dynamics/loop_report.hpp"
#include "linkwise/dynamics/loop_system.hpp"
#include "linkwise/dynamics/loop_wrenches.hpp"
#include "linkwise/recursion/piece_group.hpp"
#include "linkwise/solve/direct/tree_factor.hpp"

namespace linkwise {

/// Of one piece, in one lane, where loops close.
struct ClosedPiece {
  Transform<double> across;  ///< frame of the last body of the piece before -> of its own last one
  Motion<double> v_last;
  Transform<double> outboard;  ///< frame of its last body -> of the outboard cut joint's body
  bool ends_chain;             ///< no piece follows
  PieceResponse<double, 6> response;
};

class PieceClosure {
 public:
  /// Rows of all loop joints together: more would make Lambda dear.
  static constexpr int most_rows = 36;

  PieceClosure(const Model& model, const ChainPieces& pieces);

  /// Bodies on which loop joints push, ascending.
  static std::vector<int> end_bodies(const Model& model);

  /// Loop joints at a state, of the pieces' positions and velocities. Tells in.on_loops, who may
  /// give them torques.
  void update(SweepInput<double>& in, std::span<const ClosedPiece> pieces);
  /// What is known of their wrenches: add(piece, wrench on its last body).
  template <class F>
  void known_wrenches(F&& add) const {
    if (!torques_.any()) return;
    for (size_t l = 0; l < ends_.size(); ++l) {
      const Force<double> w = torques_.wrench(states_[static_cast<int>(l)]);
      if (ends_[l].a >= 0) add(ends_[l].a, wrench_on_a(states_[static_cast<int>(l)], w));
      if (ends_[l].b >= 0) add(ends_[l].b, wrench_on_b(model_.loops.joints[l], w));
    }
  }
  /// f: of the cuts, without the loops, which it takes in. ground: the acceleration of the ground.
  void solve(std::span<const ClosedPiece> pieces, const Motion<double>& ground, TreeFactor& A,
             std::span<double> f, bool with_loads);
  /// Of the last solve: what loop joints push at the end of a piece, as outboard forces.
  const double* pushed(int piece) const {
    return port_of_[piece] < 0 ? nullptr : &push_[6 * static_cast<size_t>(port_of_[piece])];
  }
  /// From now on rows ask for these numbers [n_loops][6], and pivots below `null` are zero; null
  /// pointer: for what the rates ask.
  void ask(const double* asked, double null) {
    asked_ = asked;
    null_ = null;
  }
  /// loads [n_loops][6].
  void store_loads(double* loads) const;
  const LoopReport& report() const { return report_; }
  const LoopStates& states() const { return states_; }

 private:
  /// Pieces that the bodies of a loop joint end; -1: ground.
  struct Ends {
    int a, b;
  };
  /// One component after the other of unit force j at a port.
  double* at_port(int j, int piece) {
    return &w_[6 * (static_cast<size_t>(j) * n_ports_ + port_of_[piece])];
  }
  double* column(int j) { return &F_[static_cast<size_t>(j) * n_cut_]; }
  void place_forces(std::span<const ClosedPiece> pieces, const Motion<double>& ground,
                    std::span<const double> f);
  void ask_cuts(std::span<const ClosedPiece> pieces, TreeFactor& A);
  void add_energy(const ClosedPiece& piece, int s);
  void factor(bool with_loads);

  const Model& model_;
  LoopStates states_;
  LoopMetric metric_;
  LoopTorques torques_;
  std::vector<Ends> ends_;    ///< by loop
  std::vector<int> port_of_;  ///< by piece; -1: nothing pushes there
  int n_ports_ = 0, n_cut_;
  LoopGroup group_;  ///< all loop joints: chains couple them all
  std::optional<LoopSystem> system_;
  std::vector<LoopEnds> at_;
  std::vector<double> w_, F_, push_;             ///< [rows][ports][6], [rows][cut rows], [ports][6]
  std::vector<double> Lambda_, r_, size_, phi_;  ///< [rows][rows], [rows]
  /// Of one piece, of each unit force.
  struct Driven {
    double outboard[6], held[6];  ///< forces at the outboard cut, and Lambda_s times them
    Force<double> g;              ///< on the first body
    Motion<double> a;             ///< J g
  };
  std::vector<Driven> driven_;
  LoopReport report_;
  const double* asked_ = nullptr;
  double null_ = 0;
};

}  // namespace linkwise
