#pragma once
// Assembles A f = b of a machine whose joints close loops or whose links bend, and reads motion and
// loads back from f.
// A constraint i, be it a joint of the tree, a joint that closes a loop, a rod or a coupling, acts
// on a few bodies k,
//     sum_k G_ik a_k = r_i,      w_k += G_ik^T f_i,
//     A_ij = sum_k G_ik M_k^-1 G_jk^T + compliance,   b_i = r_i - sum_k G_ik afree_k.
// Of joint n of the tree, on parent p, G_n = B^T, G_p = -B^T X_n, r = B^T c_n + tau / armature
// (joint_constraint.hpp); of a loop joint G and r are those of loop_states.hpp. A coupling has
// G = p' P^+ of its joints, -p' P^+ X of their parents. What the ground's acceleration adds is in
// r. An elastic body moves two frames, the second on its port (elastic_boxes.hpp). A body without
// mass on a port is that frame. Never solves.
#include <string>
#include <vector>

#include "linkwise/constraint/elastic_boxes.hpp"
#include "linkwise/constraint/joint_constraint.hpp"
#include "linkwise/kinematics/loop_states.hpp"
#include "linkwise/linear/block_graph.hpp"

namespace linkwise {

class GraphSystem {
 public:
  /// InputError: refusal_of_graph().
  explicit GraphSystem(const Model& model);

  const BlockGraph& A() const { return A_; }
  const std::vector<double>& b() const { return b_; }
  /// Sums of the lengths of what makes up b.
  const std::vector<double>& size() const { return size_; }
  const LoopStates& loops() const { return loops_; }
  /// Nodes of A: joints of bodies, loop joints, couplings. The body to name for one.
  int body_of_node(int node) const;
  /// Have all elastic bodies accelerations? As assembled.
  bool is_regular() const { return is_regular_; }

  /// asked: [n_loops][6], then [n_couplings], in place of what loops and couplings ask for; or
  /// null.
  void assemble(const SweepInput<double>& in, const double* asked = nullptr);
  /// du [nv] from the solution f; loads [n_joints + n_loops][6] or null.
  void recover(const SweepInput<double>& in, const std::vector<double>& f, double* du,
               double* loads);
  /// By what part of the largest acceleration those that recover() found miss the constraints.
  double violation() const { return violation_; }
  /// What assemble_rest() found missing: of torques and forces over the largest that a joint
  /// transmits, of accelerations over the largest one.
  double rest() const { return rest_; }

  /// Refinement: b of what f and du miss. The joints of the tree hold exactly with accelerations
  /// that follow from du; missed are torques, by Newton and Euler, and what loops and couplings
  /// ask for. After recover(), and again after add_rest().
  void assemble_rest(const SweepInput<double>& in, const std::vector<double>& f, const double* du);
  /// Adds the answer df of that system to f, du and loads.
  void add_rest(const SweepInput<double>& in, const std::vector<double>& df, std::vector<double>& f,
                double* du, double* loads);

  /// What each coupling puts into each of its joints, coupling after coupling.
  void coupling_loads(const std::vector<double>& f, std::vector<double>& loads) const;

 private:
  int node_of_loop(int l) const { return model_->n_bodies() + l; }
  int node_of_coupling(int c) const { return model_->n_bodies() + model_->n_loops() + c; }
  /// A moving frame: place of its six numbers among those of a hub. No hub: the ground.
  struct Site {
    int hub = -1, first = 0;
  };
  Site site_of(int body) const;
  /// Where the joint of body n sits on its parent.
  Site site_inboard(int n) const;
  /// a_ of a frame.
  double* motion(const Site& at) { return &a_[A_.motion_begin[at.hub] + at.first]; }
  const double* motion(const Site& at) const { return &a_[A_.motion_begin[at.hub] + at.first]; }
  Motion<double> acceleration(int body) const { return to_motion(motion(site_of(body))); }
  /// Row r of a node acts on a frame by a wrench.
  void put(int node, int r, const Site& at, const Force<double>& wrench);
  void put(int node, int r, int body, const Force<double>& wrench) {
    put(node, r, site_of(body), wrench);
  }
  void ask(int node, int r, double of_row);
  void assemble_joint(int n, const double* tau);
  void assemble_loop(int l, const double* asked);
  void assemble_coupling(int c, const SweepInput<double>& in, const double* asked);
  void place_term(int c, size_t t);
  /// Torques [nv] act on the bodies, but for those of rotors.
  void apply_torques(const double* tau);
  void apply_loop_torques(const SweepInput<double>& in);
  void finish_b();
  void set_acceleration(int n, const Motion<double>& a);
  /// a_ of a body's frames under wrenches on them.
  void accelerate(int n, const double* w);
  /// g_ of the frames of body n's hub.
  void known_wrenches(int n, double* w) const;
  /// The loads of the joints of bodies without mass on ports: what these hand on.
  void carry_massless();
  /// Adds to w_ and loop_w_ what constraint forces make of them.
  void add_forces(const std::vector<double>& f);
  /// a_ of the known wrenches and constraint forces.
  void calc_accelerations(const std::vector<double>& f);
  /// Of joint n of the tree.
  Vector6<double> relative_acceleration(int n) const;
  void calc_violation();
  void calc_rest();
  double row_of_accelerations(int i, int r) const;
  void calc_motion(const double* du);
  void calc_torques_missed(const SweepInput<double>& in, const std::vector<double>& f,
                           const double* du);
  void store_loads(const double* q, double* loads) const;

  const Model* model_;
  BlockGraph A_;
  std::vector<double> b_, r_, size_;
  std::vector<double> asked_;  ///< r as assembled
  ElasticBoxes boxes_;
  std::vector<char> is_massless_;  ///< and on a port
  std::vector<BodyState<double>> state_;
  std::vector<GeneralState<double>> general_;
  std::vector<JointConstraint<double>> joint_;
  LoopStates loops_;
  std::vector<std::vector<int>> columns_;    ///< by coupling and term: of its joint's P, or -1
  std::vector<std::vector<double>> slopes_;  ///< the same: p' at the state
  Motion<double> ground_, given_ground_;  ///< its acceleration: of the system at hand, as assembled
  bool with_bias_ = true;                 ///< do velocities count?
  bool is_regular_ = true;
  std::vector<Force<double>> g_;                      ///< known wrenches on bodies
  std::vector<Force<double>> known_, known_of_loop_;  ///< what joints transmit of torques
  std::vector<Force<double>> w_, loop_w_;             ///< what they transmit
  std::vector<double> a_;                             ///< of the hubs, as BlockGraph lays them out
  std::vector<double> tau_;
  double violation_ = 0, rest_ = 0;
};

}  // namespace linkwise
