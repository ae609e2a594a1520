#pragma once
// Block trees for tests, made without any mechanism: A = B C B^T with one 6 x 6 SPD compliance C_i
// per body and, in row i of B, the joint's directions K_i on body i and -H_i on its parent.

#include <cstdint>
#include <random>
#include <string>
#include <vector>

#include "linkwise/linear/block_tree.hpp"

namespace linkwise::testing {

using Matrix6 = Block;

struct Joint {
  int parent = -1;
  int dim = 5;
  Matrix6 compliance{};  ///< of the outboard body, at this joint
  Block directions{};    ///< K, dim x 6, in the outboard body's frame
  Matrix6 shift{};       ///< X: motion of the inboard body to this joint's frame
};

/// A from its bodies and joints.
BlockTree assemble(const std::vector<Joint>& joints);

enum class Shape { chain, star, random_tree, bushy_tree };
enum class Dims { five, six, three, mixed /*0..6*/ };

std::string name_of(Shape shape, Dims dims, int n);

/// Random SPD compliances, random orthonormal directions, random shifts.
BlockTree random_tree(Shape shape, Dims dims, int n, std::uint64_t seed);

enum class RodJoint { spherical, revolute_parallel, revolute_alternating, revolute_random };

struct RodChain {
  RodJoint joint = RodJoint::spherical;
  bool bent = false;
  int n = 16;
};

std::string name_of(const RodChain& chain);

/// Chain of uniform rigid rods, length 1, mass 1, radius 0.05, on the ground: the chains of
/// docs/theory/conjugate_gradients.md.
BlockTree rod_chain(const RodChain& chain, std::uint64_t seed = 1);

/// Every kind of rod chain at one length.
std::vector<RodChain> all_rod_chains(int n);

std::vector<double> random_vector(int size, std::uint64_t seed);

}  // namespace linkwise::testing
