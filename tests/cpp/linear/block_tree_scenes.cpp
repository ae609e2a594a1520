#include "linear/block_tree_scenes.hpp"

#include <cmath>

namespace linkwise::testing {
namespace {

using Random = std::mt19937_64;

double normal(Random& random) { return std::normal_distribution<double>()(random); }

Matrix6 product(const Matrix6& a, const Matrix6& b) {
  Matrix6 c{};
  for (int i = 0; i < 6; ++i)
    for (int j = 0; j < 6; ++j)
      for (int k = 0; k < 6; ++k) c[6 * i + j] += a[6 * i + k] * b[6 * k + j];
  return c;
}

Matrix6 transposed(const Matrix6& a) {
  Matrix6 t{};
  for (int i = 0; i < 6; ++i)
    for (int j = 0; j < 6; ++j) t[6 * j + i] = a[6 * i + j];
  return t;
}

void add(Matrix6& to, const Matrix6& from) {
  for (int k = 0; k < 36; ++k) to[k] += from[k];
}

/// Rows that are orthonormal; the first `rows` are kept.
Block orthonormal_rows(int rows, Random& random) {
  Block q{};
  for (int i = 0; i < rows; ++i) {
    double row[6];
    for (double& value : row) value = normal(random);
    for (int pass = 0; pass < 2; ++pass)
      for (int k = 0; k < i; ++k) {
        double overlap = 0.0;
        for (int j = 0; j < 6; ++j) overlap += row[j] * q[6 * k + j];
        for (int j = 0; j < 6; ++j) row[j] -= overlap * q[6 * k + j];
      }
    double length = 0.0;
    for (double value : row) length += value * value;
    for (int j = 0; j < 6; ++j) q[6 * i + j] = row[j] / std::sqrt(length);
  }
  return q;
}

Matrix6 random_compliance(Random& random) {
  Matrix6 factor{};
  for (double& value : factor) value = 0.5 * normal(random);
  Matrix6 spd = product(factor, transposed(factor));
  for (int i = 0; i < 6; ++i) spd[7 * i] += 0.2;
  return spd;
}

int random_dim(Dims dims, Random& random) {
  switch (dims) {
    case Dims::five:
      return 5;
    case Dims::six:
      return 6;
    case Dims::three:
      return 3;
    case Dims::mixed:
      return static_cast<int>(random() % 7);
  }
  return 5;
}

int random_parent(Shape shape, int i, Random& random) {
  if (i == 0) return -1;
  switch (shape) {
    case Shape::chain:
      return i - 1;
    case Shape::star:
      return 0;
    case Shape::random_tree:
      return static_cast<int>(random() % (i + 1)) - 1;
    case Shape::bushy_tree:
      return (i - 1) / 3;
  }
  return i - 1;
}

struct Vector3 {
  double x, y, z;
};

using Matrix3 = std::array<double, 9>;

Matrix3 rotation(Vector3 axis, double angle) {
  const double length = std::sqrt(axis.x * axis.x + axis.y * axis.y + axis.z * axis.z);
  const double x = axis.x / length, y = axis.y / length, z = axis.z / length;
  const double c = std::cos(angle), s = std::sin(angle), v = 1.0 - c;
  return {c + x * x * v,     x * y * v - z * s, x * z * v + y * s, y * x * v + z * s, c + y * y * v,
          y * z * v - x * s, z * x * v - y * s, z * y * v + x * s, c + z * z * v};
}

/// Motion transform to a frame at distance `length` along the parent's x axis, rotated by `turn`.
Matrix6 rod_shift(const Matrix3& turn, double length) {
  // -r~ of r = (length, 0, 0) has entries (1, 2) = length and (2, 1) = -length.
  Matrix6 shift{};
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) {
      const double r = turn[3 * j + i];  // parent axes to this frame's
      shift[6 * i + j] = r;
      shift[6 * (i + 3) + j + 3] = r;
    }
  for (int i = 0; i < 3; ++i) {
    shift[6 * i + 3 + 2] += shift[6 * i + 1] * length;
    shift[6 * i + 3 + 1] -= shift[6 * i + 2] * length;
  }
  return shift;
}

/// Inverse of a rod's 6 x 6 inertia at its end, linear first.
Matrix6 rod_compliance() {
  constexpr double length = 1.0, mass = 1.0, radius = 0.05;
  const double along = mass * radius * radius / 2;
  const double across = mass * (3 * radius * radius + length * length) / 12;
  const double lever = length / 2;
  Matrix6 c{};
  c[0] = 1.0 / mass;
  c[7] = c[14] = 1.0 / mass + lever * lever / across;
  c[21] = 1.0 / along;
  c[28] = c[35] = 1.0 / across;
  c[6 * 1 + 5] = c[6 * 5 + 1] = -lever / across;
  c[6 * 2 + 4] = c[6 * 4 + 2] = lever / across;
  return c;
}

Vector3 joint_axis(RodJoint joint, int i, Random& random) {
  switch (joint) {
    case RodJoint::revolute_alternating:
      return i % 2 ? Vector3{0.0, 1.0, 0.0} : Vector3{0.0, 0.0, 1.0};
    case RodJoint::revolute_random:
      return {normal(random), normal(random), normal(random)};
    default:
      return {0.0, 0.0, 1.0};
  }
}

/// All directions but the rotation about the axis; of a spherical joint the three translations.
Block rod_directions(RodJoint joint, Vector3 axis) {
  Block rows{};
  for (int i = 0; i < 3; ++i) rows[7 * i] = 1.0;
  if (joint == RodJoint::spherical) return rows;
  const double length = std::sqrt(axis.x * axis.x + axis.y * axis.y + axis.z * axis.z);
  const double a[3] = {axis.x / length, axis.y / length, axis.z / length};
  const int smallest = std::abs(a[0]) < std::abs(a[1]) ? (std::abs(a[0]) < std::abs(a[2]) ? 0 : 2)
                                                       : (std::abs(a[1]) < std::abs(a[2]) ? 1 : 2);
  double u[3] = {-a[smallest] * a[0], -a[smallest] * a[1], -a[smallest] * a[2]};
  u[smallest] += 1.0;
  const double norm = std::sqrt(u[0] * u[0] + u[1] * u[1] + u[2] * u[2]);
  for (double& value : u) value /= norm;
  const double w[3] = {a[1] * u[2] - a[2] * u[1], a[2] * u[0] - a[0] * u[2],
                       a[0] * u[1] - a[1] * u[0]};
  for (int j = 0; j < 3; ++j) {
    rows[6 * 3 + 3 + j] = u[j];
    rows[6 * 4 + 3 + j] = w[j];
  }
  return rows;
}

}  // namespace

BlockTree assemble(const std::vector<Joint>& joints) {
  const int n = static_cast<int>(joints.size());
  std::vector<int> parents(n), dims(n);
  for (int i = 0; i < n; ++i) {
    parents[i] = joints[i].parent;
    dims[i] = joints[i].dim;
  }
  BlockTree tree;
  tree.set_structure(parents, dims);
  for (int i = 0; i < n; ++i) {
    const Joint& joint = joints[i];
    const Block& k = joint.directions;
    Matrix6 diag = product(product(k, joint.compliance), transposed(k));
    const int p = joint.parent;
    if (p >= 0) {
      const Matrix6 lever = product(k, joint.shift);
      const Matrix6 passed = product(lever, joints[p].compliance);
      add(diag, product(passed, transposed(lever)));
      if (tree.lever_of[i] >= 0) {
        tree.levers[tree.lever_of[i]] = lever;
      } else {
        Matrix6 coupling = product(passed, transposed(joints[p].directions));
        for (double& value : coupling) value = -value;
        tree.parent_block[i] = coupling;
      }
    }
    for (int r = 0; r < 6; ++r)
      for (int c = 0; c < r; ++c)
        diag[6 * r + c] = diag[6 * c + r] = 0.5 * (diag[6 * r + c] + diag[6 * c + r]);
    tree.diag[i] = diag;
    if (tree.hub[i] >= 0) {
      tree.hubs[tree.hub[i]].compliance = joint.compliance;
      tree.hubs[tree.hub[i]].inboard = k;
    }
  }
  return tree;
}

std::string name_of(Shape shape, Dims dims, int n) {
  const char* shapes[] = {"chain", "star", "random_tree", "bushy_tree"};
  const char* widths[] = {"five", "six", "three", "mixed"};
  return std::string(shapes[static_cast<int>(shape)]) + "_" + widths[static_cast<int>(dims)] + "_" +
         std::to_string(n);
}

BlockTree random_tree(Shape shape, Dims dims, int n, std::uint64_t seed) {
  Random random(seed);
  std::vector<Joint> joints(n);
  for (int i = 0; i < n; ++i) {
    Joint& joint = joints[i];
    joint.parent = random_parent(shape, i, random);
    joint.dim = random_dim(dims, random);
    joint.compliance = random_compliance(random);
    joint.directions = orthonormal_rows(joint.dim, random);
    const Matrix3 turn = rotation({normal(random), normal(random), normal(random)}, normal(random));
    joint.shift = rod_shift(turn, 0.3 * normal(random));
  }
  return assemble(joints);
}

std::string name_of(const RodChain& chain) {
  const char* joints[] = {"spherical", "revolute_parallel", "revolute_alternating",
                          "revolute_random"};
  return std::string(joints[static_cast<int>(chain.joint)]) + (chain.bent ? "_bent" : "_straight") +
         "_" + std::to_string(chain.n);
}

BlockTree rod_chain(const RodChain& chain, std::uint64_t seed) {
  Random random(seed);
  std::uniform_real_distribution<double> angle(-1.0, 1.0);
  std::vector<Joint> joints(chain.n);
  for (int i = 0; i < chain.n; ++i) {
    Joint& joint = joints[i];
    joint.parent = i - 1;
    joint.dim = chain.joint == RodJoint::spherical ? 3 : 5;
    joint.compliance = rod_compliance();
    Vector3 axis = joint_axis(chain.joint, i, random);
    joint.directions = rod_directions(chain.joint, axis);
    if (chain.joint == RodJoint::spherical) axis = {normal(random), normal(random), normal(random)};
    joint.shift = rod_shift(rotation(axis, chain.bent ? angle(random) : 0.0), 1.0);
  }
  return assemble(joints);
}

std::vector<RodChain> all_rod_chains(int n) {
  std::vector<RodChain> all;
  for (RodJoint joint : {RodJoint::spherical, RodJoint::revolute_parallel,
                         RodJoint::revolute_alternating, RodJoint::revolute_random})
    for (bool bent : {false, true}) all.push_back({joint, bent, n});
  return all;
}

std::vector<double> random_vector(int size, std::uint64_t seed) {
  Random random(seed);
  std::vector<double> x(size);
  for (double& value : x) value = normal(random);
  return x;
}

}  // namespace linkwise::testing
