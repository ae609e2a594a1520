#pragma once
// The slow, obvious twin of all sweeps. It works on the links and joints as the user gave them
// (no merging, no stacking, no aligned axes), in world axes, with Rodrigues' formula and one screw
// per degree of freedom. Velocities are differentiated by a complex step, so no bias term is
// derived by hand: forces are rates of momentum. Cost: O(links) per call, O(nv) calls for forward
// dynamics.

#include <complex>
#include <stdexcept>
#include <vector>

#include "linkwise/model/model.hpp"

namespace linkwise::testing {

template <class T>
struct Pose {
  Mat3<T> R = Mat3<T>::identity();  ///< frame -> world axes
  Vec3<T> p;
};

/// Velocity field w x point + s of a rigid motion in the world.
template <class T>
struct Screw {
  Vec3<T> w, s;
};

class WorldTwin {
 public:
  using Complex = std::complex<double>;

  /// Takes from the model the user's description and where each joint's coordinates lie; nothing
  /// else. The model must live on.
  explicit WorldTwin(const Model& model) : model_(model) {
    const ModelSpec& spec = model.spec();
    joints_ = spec.joints;
    std::vector<int> inboard(spec.links.size(), -1);
    for (size_t j = 0; j < joints_.size(); ++j) inboard[link_named(joints_[j].child)] = j;
    for (size_t l = 0; l < inboard.size(); ++l)
      if (inboard[l] < 0) root_ = static_cast<int>(l);
    JointSpec base;
    base.type = spec.floating_base ? JointType::floating : JointType::fixed;
    base.name = spec.floating_joint;
    base.child = spec.links[root_].name;
    inboard[root_] = static_cast<int>(joints_.size());
    joints_.push_back(base);
    for (const JointSpec& j : joints_)
      parent_link_.push_back(j.parent.empty() ? -1 : link_named(j.parent));
    // Parents first, by walking from every link to the root.
    std::vector<char> placed(inboard.size(), 0);
    for (size_t l = 0; l < inboard.size(); ++l) {
      std::vector<int> path;
      for (int at = static_cast<int>(l); !placed[at]; at = parent_of(inboard[at])) {
        path.push_back(at);
        placed[at] = 1;
        if (at == root_) break;
      }
      for (size_t i = path.size(); i-- > 0;) order_.push_back({path[i], inboard[path[i]]});
    }
    for (const JointSpec& j : joints_) infos_.push_back(info_of(j.name));
  }

  /// Poses of all links, and the world screw of every degree of freedom.
  template <class T>
  struct Motions {
    std::vector<Pose<T>> pose;
    std::vector<Screw<T>> dof;
    std::vector<Screw<T>> velocity;  ///< of every link
  };

  template <class T>
  Motions<T> motions(const std::vector<T>& q, const std::vector<T>& v) const {
    Motions<T> out;
    out.pose.resize(model_.spec().links.size());
    out.velocity.resize(out.pose.size());
    out.dof.resize(model_.nv());
    for (const auto& [link, joint] : order_) {
      const int parent = parent_of(joint);
      Pose<T> at;
      Screw<T> velocity;
      if (parent >= 0) {
        at = out.pose[parent];
        velocity = out.velocity[parent];
      }
      const JointSpec& s = joints_[joint];
      at.p += at.R * s.translation;
      at.R = at.R * s.rotation;
      const JointInfo* info = infos_[joint];
      if (info) move(s, *info, q, at, out.dof);
      for (int k = 0; info && k < info->nv; ++k) {
        const Screw<T>& column = out.dof[info->v + k];
        velocity.w += v[info->v + k] * column.w;
        velocity.s += v[info->v + k] * column.s;
      }
      out.pose[link] = at;
      out.velocity[link] = velocity;
    }
    return out;
  }

  /// dq/dt, quaternions as q' = q (w, 0) / 2.
  std::vector<double> position_rate(const std::vector<double>& q,
                                    const std::vector<double>& v) const {
    std::vector<double> rate(q.size());
    for (const JointInfo& j : model_.joints) {
      int iq = j.q, iv = j.v;
      if (j.type == JointType::floating) {
        const Vec3<double> r = rotation_of(&q[iq + 3]) * Vec3<double>{v[iv], v[iv + 1], v[iv + 2]};
        rate[iq++] = r.x;
        rate[iq++] = r.y;
        rate[iq++] = r.z;
        iv += 3;
      }
      if (j.type == JointType::floating || j.type == JointType::spherical) {
        const Vec3<double> e{q[iq], q[iq + 1], q[iq + 2]}, w{v[iv], v[iv + 1], v[iv + 2]};
        const Vec3<double> turned = q[iq + 3] * w + cross(e, w);
        rate[iq] = turned.x / 2;
        rate[iq + 1] = turned.y / 2;
        rate[iq + 2] = turned.z / 2;
        rate[iq + 3] = -dot(e, w) / 2;
      } else if (j.type == JointType::planar) {
        const double c = std::cos(q[iq + 2]), s = std::sin(q[iq + 2]);
        rate[iq] = c * v[iv] - s * v[iv + 1];
        rate[iq + 1] = s * v[iv] + c * v[iv + 1];
        rate[iq + 2] = v[iv + 2];
      } else {
        for (int k = 0; k < j.nv; ++k) rate[iq + k] = v[iv + k];
      }
    }
    return rate;
  }

  /// (q, v) moved by a tiny imaginary time along (dq/dt, du): parts / step are time derivatives.
  Motions<Complex> moved(const std::vector<double>& q, const std::vector<double>& v,
                         const std::vector<double>& du) const {
    const std::vector<double> rate = position_rate(q, v);
    std::vector<Complex> q_moved, v_moved;
    for (size_t i = 0; i < q.size(); ++i) q_moved.emplace_back(q[i], step * rate[i]);
    for (size_t i = 0; i < v.size(); ++i) v_moved.emplace_back(v[i], step * du[i]);
    return motions(q_moved, v_moved);
  }
  static constexpr double step = 1e-40;

  struct Inverse {
    std::vector<double> tau, loads;  ///< [nv], [n_joints][6]
  };
  /// external: [n_joints][6] at the joints' frames, or empty.
  Inverse inverse_dynamics(const std::vector<double>& q, const std::vector<double>& v,
                           const std::vector<double>& du, const std::vector<double>& external = {},
                           double gravity_factor = 1) const {
    const ModelSpec& spec = model_.spec();
    const Motions<Complex> m = moved(q, v, du);
    // Per link: force, and moment about the world's origin, that the link and all outboard need.
    std::vector<Vec3<double>> force(spec.links.size()), moment(spec.links.size());
    for (size_t l = 0; l < spec.links.size(); ++l) {
      const LinkSpec& link = spec.links[l];
      const Pose<Complex>& at = m.pose[l];
      const Vec3<Complex> c = at.p + at.R * link.com, w = m.velocity[l].w;
      const Vec3<Complex> p = link.mass * (m.velocity[l].s + cross(w, c));
      const Vec3<Complex> L = at.R * (link.inertia * transpose_times(at.R, w)) + cross(c, p);
      const Vec3<double> weight = (gravity_factor * link.mass) * spec.gravity;
      force[l] = rate_of(p) - weight;
      moment[l] = rate_of(L) - cross(real(c), weight);
    }
    for (int j = 0; j < model_.n_joints() && !external.empty(); ++j) {
      const int l = model_.joints[j].link;
      const double* f = &external[6 * j];
      const Vec3<double> lin = real(m.pose[l].R) * Vec3<double>{f[0], f[1], f[2]};
      force[l] -= lin;
      moment[l] -=
          real(m.pose[l].R) * Vec3<double>{f[3], f[4], f[5]} + cross(real(m.pose[l].p), lin);
    }
    for (size_t i = order_.size(); i-- > 0;)
      if (const int parent = parent_of(order_[i].joint); parent >= 0) {
        force[parent] += force[order_[i].link];
        moment[parent] += moment[order_[i].link];
      }
    Inverse out{std::vector<double>(model_.nv()), {}};
    for (int j = 0; j < model_.n_joints(); ++j) {
      const JointInfo& info = model_.joints[j];
      const Vec3<double> f = force[info.link], n = moment[info.link];
      for (int k = info.v; k < info.v + info.nv; ++k)
        out.tau[k] = dot(real(m.dof[k].w), n) + dot(real(m.dof[k].s), f) +
                     model_.dof_values(DofProperty::armature)[k] * du[k];
      const Pose<Complex>& at = m.pose[info.link];
      const Vec3<double> in_frame = transpose_times(real(at.R), f);
      const Vec3<double> about_point = transpose_times(real(at.R), n - cross(real(at.p), f));
      for (const Vec3<double>& part : {in_frame, about_point})
        out.loads.insert(out.loads.end(), {part.x, part.y, part.z});
    }
    add_turning_armatures(v, out.tau);
    return out;
  }

  /// w x (D u) of joints whose rates are components along axes that turn at w.
  void add_turning_armatures(const std::vector<double>& v, std::vector<double>& tau) const {
    const auto& D = model_.dof_values(DofProperty::armature);
    const auto add = [&](int turned, const Vec3<double>& w) {  // the three rates from there on
      const int i = turned;
      const double p[3] = {D[i] * v[i], D[i + 1] * v[i + 1], D[i + 2] * v[i + 2]};
      tau[i] += w.y * p[2] - w.z * p[1];
      tau[i + 1] += w.z * p[0] - w.x * p[2];
      tau[i + 2] += w.x * p[1] - w.y * p[0];
    };
    for (const Element& e : model_.elements) {
      const int i = e.v;
      if (e.kind == ElementKind::planar) {
        tau[i] -= v[i + 2] * D[i + 1] * v[i + 1];
        tau[i + 1] += v[i + 2] * D[i] * v[i];
      } else if (e.kind == ElementKind::spherical) {
        add(i, {v[i], v[i + 1], v[i + 2]});
      } else if (e.kind == ElementKind::floating) {
        add(i, {v[i + 3], v[i + 4], v[i + 5]});
        add(i + 3, {v[i + 3], v[i + 4], v[i + 5]});
      }
    }
  }

  /// nv x nv, row-major, armature included; column by column from unit accelerations at rest.
  std::vector<double> mass_matrix(const std::vector<double>& q) const {
    const size_t nv = model_.nv();
    std::vector<double> H(nv * nv);
    for (size_t k = 0; k < nv; ++k) {
      std::vector<double> unit(nv);
      unit[k] = 1;
      const Inverse column = inverse_dynamics(q, std::vector<double>(nv), unit, {}, 0);
      for (size_t i = 0; i < nv; ++i) H[i * nv + k] = column.tau[i];
    }
    return H;
  }

  /// du holds the accelerations of prescribed joints, the others are solved for.
  void forward_dynamics(const std::vector<double>& q, const std::vector<double>& v,
                        const std::vector<double>& tau, const std::vector<double>& external,
                        std::vector<double>& du) const {
    std::vector<int> free;
    for (const Element& e : model_.elements)
      for (int k = 0; k < e.nv; ++k) {
        if (e.prescribed) continue;
        free.push_back(e.v + k);
        du[e.v + k] = 0;
      }
    const std::vector<double> H = mass_matrix(q), bias = inverse_dynamics(q, v, du, external).tau;
    const size_t n = free.size();
    std::vector<std::vector<long double>> A(n, std::vector<long double>(n + 1));
    for (size_t i = 0; i < n; ++i) {
      for (size_t j = 0; j < n; ++j) A[i][j] = H[free[i] * model_.nv() + free[j]];
      A[i][n] = tau[free[i]] - bias[free[i]];
    }
    for (size_t j = 0; j < n; ++j)  // positive definite: no pivoting
      for (size_t i = 0; i < n; ++i) {
        if (i == j) continue;
        const long double factor = A[i][j] / A[j][j];
        for (size_t k = j; k <= n; ++k) A[i][k] -= factor * A[j][k];
      }
    for (size_t i = 0; i < n; ++i) du[free[i]] = static_cast<double>(A[i][n] / A[i][i]);
  }

  static Vec3<double> real(const Vec3<Complex>& a) { return {a.x.real(), a.y.real(), a.z.real()}; }
  static Mat3<double> real(const Mat3<Complex>& a) {
    Mat3<double> out;
    for (int i = 0; i < 9; ++i) out.m[i] = a.m[i].real();
    return out;
  }
  static Vec3<double> rate_of(const Vec3<Complex>& a) {
    return {a.x.imag() / step, a.y.imag() / step, a.z.imag() / step};
  }

  /// Frame -> previous axes, of a quaternion of any length.
  template <class T>
  static Mat3<T> rotation_of(const T* e) {
    const T x = e[0], y = e[1], z = e[2], w = e[3], n = x * x + y * y + z * z + w * w;
    return {{(w * w + x * x - y * y - z * z) / n, 2.0 * (x * y - w * z) / n,
             2.0 * (x * z + w * y) / n, 2.0 * (x * y + w * z) / n,
             (w * w - x * x + y * y - z * z) / n, 2.0 * (y * z - w * x) / n,
             2.0 * (x * z - w * y) / n, 2.0 * (y * z + w * x) / n,
             (w * w - x * x - y * y + z * z) / n}};
  }

 private:
  struct Visit {
    int link, joint;
  };

  int link_named(const std::string& name) const {
    const auto& links = model_.spec().links;
    for (size_t l = 0; l < links.size(); ++l)
      if (links[l].name == name) return static_cast<int>(l);
    throw std::logic_error("no link " + name);
  }
  int parent_of(int joint) const { return parent_link_[joint]; }
  const JointInfo* info_of(const std::string& name) const {
    for (const JointInfo& info : model_.joints)
      if (info.name == name) return &info;
    return nullptr;
  }

  static Vec3<double> unit(Vec3<double> a) { return (1 / std::sqrt(dot(a, a))) * a; }

  /// exp(angle a~) = 1 + sin a~ + (1 - cos) a~^2.
  template <class T>
  static Mat3<T> rodrigues(const Vec3<double>& a, T angle) {
    using std::cos, std::sin;
    const T s = sin(angle), c = T(1) - cos(angle);
    const double k[9] = {0, -a.z, a.y, a.z, 0, -a.x, -a.y, a.x, 0};
    Mat3<T> R = Mat3<T>::identity();
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) {
        double k2 = 0;
        for (int l = 0; l < 3; ++l) k2 += k[3 * i + l] * k[3 * l + j];
        R.m[3 * i + j] += s * k[3 * i + j] + c * k2;
      }
    return R;
  }

  template <class T>
  static Screw<T> turn(const Pose<T>& at, const Vec3<T>& axis) {
    return {axis, cross(at.p, axis)};
  }

  /// One axis of a stack: moves the pose and writes the screw.
  template <class T>
  static void move_axis(AxisKind kind, const AxisSpec& spec, T q, Pose<T>& at, Screw<T>& screw) {
    const Vec3<double> axis = unit(spec.axis);
    const Vec3<T> world = at.R * axis;
    const double pitch = kind == AxisKind::helical ? spec.pitch : 0;
    screw = kind == AxisKind::prismatic ? Screw<T>{{}, world} : turn(at, world);
    if (kind == AxisKind::helical) screw.s += pitch * world;
    at.p += (kind == AxisKind::prismatic ? q : pitch * q) * world;
    if (kind != AxisKind::prismatic) at.R = at.R * rodrigues(axis, q);
  }

  /// Axes in the plane with normal n: x and y turned along with z by the smallest rotation, after a
  /// half turn about x where n points down. The convention of the planar joint.
  static Mat3<double> planar_axes(Vec3<double> n) {
    const bool down = n.z < 0;
    if (down) n = {n.x, -n.y, -n.z};
    const Vec3<double> axis = cross(Vec3<double>{0, 0, 1}, n);
    const double sine = std::sqrt(dot(axis, axis));
    const Mat3<double> up =
        sine > 0 ? rodrigues(unit(axis), std::atan2(sine, n.z)) : Mat3<double>::identity();
    return down ? Mat3<double>{{1, 0, 0, 0, -1, 0, 0, 0, -1}} * up : up;
  }

  template <class T>
  static void move(const JointSpec& s, const JointInfo& info, const std::vector<T>& q, Pose<T>& at,
                   std::vector<Screw<T>>& dof) {
    const T* own = q.data() + info.q;
    Screw<T>* column = dof.data() + info.v;
    const auto child_columns = [&](const Mat3<T>& R, int lin, int ang) {
      for (int k = 0; k < 3; ++k) {
        const Vec3<T> axis{R.m[k], R.m[3 + k], R.m[6 + k]};
        if (lin >= 0 && lin + k < info.nv) column[lin + k] = {{}, axis};
        if (ang >= 0) column[ang + k] = turn(at, axis);
      }
    };
    switch (s.type) {
      case JointType::fixed:
        return;
      case JointType::revolute:
      case JointType::continuous:
        return move_axis(AxisKind::revolute, s.axes[0], own[0], at, column[0]);
      case JointType::prismatic:
        return move_axis(AxisKind::prismatic, s.axes[0], own[0], at, column[0]);
      case JointType::helical:
        return move_axis(AxisKind::helical, s.axes[0], own[0], at, column[0]);
      case JointType::cylindrical:
        move_axis(AxisKind::prismatic, s.axes[0], own[0], at, column[0]);
        return move_axis(AxisKind::revolute, s.axes[0], own[1], at, column[1]);
      case JointType::universal:
        move_axis(AxisKind::revolute, s.axes[0], own[0], at, column[0]);
        return move_axis(AxisKind::revolute, s.axes[1], own[1], at, column[1]);
      case JointType::elastic:
        throw std::logic_error("the twin has rigid bodies");
      case JointType::composite:
        for (size_t k = 0; k < s.axes.size(); ++k)
          move_axis(s.axes[k].kind, s.axes[k], own[k], at, column[k]);
        return;
      case JointType::spherical:
        at.R = at.R * rotation_of(own);
        return child_columns(at.R, -1, 0);
      case JointType::floating:
        at.p += at.R * Vec3<T>{own[0], own[1], own[2]};
        at.R = at.R * rotation_of(own + 3);
        return child_columns(at.R, 0, 3);
      case JointType::planar: {
        const Mat3<double> plane = planar_axes(unit(s.axes[0].axis));
        at.p += at.R * (plane * Vec3<T>{own[0], own[1], T(0)});
        at.R = at.R * rodrigues(unit(s.axes[0].axis), own[2]);
        child_columns(at.R * plane, 0, -1);
        column[2] = turn(at, at.R * unit(s.axes[0].axis));
        return;
      }
    }
  }

  const Model& model_;
  std::vector<JointSpec> joints_;        ///< the user's, and the base's at the end
  std::vector<int> parent_link_;         ///< by joint, -1: the world
  std::vector<const JointInfo*> infos_;  ///< null: not a joint of the model, welded
  std::vector<Visit> order_;             ///< parents first
  int root_ = -1;
};

}  // namespace linkwise::testing
