#include "linkwise/model/spec.hpp"

#include <cstdint>
#include <cstring>
#include <iterator>
#include <type_traits>
#include <utility>

#include "linkwise/base/error.hpp"

namespace linkwise {
namespace {

struct JointTypeEntry {
  JointType type;
  const char* name;
  int dof;  ///< -1: one per axis
};
constexpr JointTypeEntry joint_type_table[] = {
    {JointType::fixed, "fixed", 0},           {JointType::revolute, "revolute", 1},
    {JointType::continuous, "continuous", 1}, {JointType::prismatic, "prismatic", 1},
    {JointType::helical, "helical", 1},       {JointType::cylindrical, "cylindrical", 2},
    {JointType::universal, "universal", 2},   {JointType::spherical, "spherical", 3},
    {JointType::planar, "planar", 3},         {JointType::floating, "floating", 6},
    {JointType::composite, "composite", -1},
};

// A flat byte string: plain numbers in the machine's order, counts as 64-bit integers.
constexpr char magic[] = "linkwise-model-1";

struct Writer {
  std::string bytes;
  template <class T>
  void number(const T& x) {
    bytes.append(reinterpret_cast<const char*>(&x), sizeof(T));
  }
  void text(const std::string& s) {
    number<std::uint64_t>(s.size());
    bytes += s;
  }
  void reals(const double* x, size_t n) {
    bytes.append(reinterpret_cast<const char*>(x), n * sizeof(double));
  }
};

struct Reader {
  const std::string& bytes;
  size_t at = 0;
  [[noreturn]] static void fail(const char* what) {
    throw InputError(std::string("model data is ") + what +
                     "; it was not written by this version of linkwise");
  }
  void take(void* out, size_t n) {
    if (n > bytes.size() - at) fail("cut short");
    if (n == 0) return;  // `out` may be null: an empty vector's
    std::memcpy(out, bytes.data() + at, n);
    at += n;
  }
  template <class T>
  T number() {
    T x;
    take(&x, sizeof(T));
    return x;
  }
  size_t count() {
    const auto n = number<std::uint64_t>();
    if (n > bytes.size() - at) fail("cut short");
    return n;
  }
  /// An enumeration of n values, or a truth value: anything else would be read out of bounds later.
  template <class E>
  E choice(int n) {
    std::underlying_type_t<E> x{};
    take(&x, sizeof(x));
    if (x < 0 || x >= n) fail("damaged");
    return static_cast<E>(x);
  }
  bool truth() {
    const auto x = number<unsigned char>();
    if (x > 1) fail("damaged");
    return x != 0;
  }
  std::string text() {
    std::string s(count(), '\0');
    take(s.data(), s.size());
    return s;
  }
};

}  // namespace

int joint_dof(const JointSpec& joint) {
  for (const auto& entry : joint_type_table)
    if (entry.type == joint.type)
      return entry.dof >= 0 ? entry.dof : static_cast<int>(joint.axes.size());
  return 0;
}

const char* joint_type_name(JointType type) {
  for (const auto& entry : joint_type_table)
    if (entry.type == type) return entry.name;
  return "?";
}

JointType joint_type_from_name(const std::string& name) {
  std::string known;
  for (const auto& entry : joint_type_table) {
    if (name == entry.name) return entry.type;
    known += (known.empty() ? "" : ", ") + std::string(entry.name);
  }
  throw InputError("joint type '" + name + "' is unknown; known: " + known);
}

std::string serialize(const ModelSpec& spec) {
  Writer w;
  w.bytes = magic;
  w.text(spec.name);
  w.text(spec.source);
  w.reals(&spec.gravity.x, 3);
  w.number(spec.floating_base);
  w.text(spec.floating_joint);
  w.number(spec.keep_fixed);
  w.number<std::uint64_t>(spec.prescribed.size());
  for (const auto& name : spec.prescribed) w.text(name);
  w.number<std::uint64_t>(spec.links.size());
  for (const auto& l : spec.links) {
    w.text(l.name);
    w.number(l.mass);
    w.reals(&l.com.x, 3);
    w.reals(l.inertia.m, 6);
  }
  w.number<std::uint64_t>(spec.joints.size());
  for (const auto& j : spec.joints) {
    w.text(j.name);
    w.number(j.type);
    w.text(j.parent);
    w.text(j.child);
    w.reals(j.rotation.m, 9);
    w.reals(&j.translation.x, 3);
    w.number<std::uint64_t>(j.axes.size());
    for (const auto& a : j.axes) {
      w.number(a.kind);
      w.reals(&a.axis.x, 3);
      w.number(a.pitch);
    }
    w.number<std::uint64_t>(j.dof.size());
    for (const auto& d : j.dof) {
      w.number(d.property);
      w.number<std::uint64_t>(d.values.size());
      w.reals(d.values.data(), d.values.size());
    }
  }
  w.number<std::uint64_t>(spec.notes.size());
  for (const auto& n : spec.notes) {
    w.number(n.level);
    w.text(n.element);
    w.text(n.text);
  }
  return std::move(w.bytes);
}

ModelSpec deserialize(const std::string& bytes) {
  Reader r{bytes};
  char head[sizeof(magic) - 1];
  r.take(head, sizeof(head));
  if (std::memcmp(head, magic, sizeof(head)) != 0)
    throw InputError(
        "model data was not written by this version of linkwise; build the model again from its "
        "source");
  ModelSpec spec;
  spec.name = r.text();
  spec.source = r.text();
  r.take(&spec.gravity.x, 3 * sizeof(double));
  spec.floating_base = r.truth();
  spec.floating_joint = r.text();
  spec.keep_fixed = r.truth();
  spec.prescribed.resize(r.count());
  for (auto& name : spec.prescribed) name = r.text();
  spec.links.resize(r.count());
  for (auto& l : spec.links) {
    l.name = r.text();
    l.mass = r.number<double>();
    r.take(&l.com.x, 3 * sizeof(double));
    r.take(l.inertia.m, sizeof(l.inertia.m));
  }
  spec.joints.resize(r.count());
  for (auto& j : spec.joints) {
    j.name = r.text();
    j.type = r.choice<JointType>(static_cast<int>(std::size(joint_type_table)));
    j.parent = r.text();
    j.child = r.text();
    r.take(j.rotation.m, sizeof(j.rotation.m));
    r.take(&j.translation.x, 3 * sizeof(double));
    j.axes.resize(r.count());
    for (auto& a : j.axes) {
      a.kind = r.choice<AxisKind>(3);
      r.take(&a.axis.x, 3 * sizeof(double));
      a.pitch = r.number<double>();
    }
    j.dof.resize(r.count());
    for (auto& d : j.dof) {
      d.property = r.choice<DofProperty>(n_dof_properties);
      d.values.resize(r.count());
      r.take(d.values.data(), d.values.size() * sizeof(double));
    }
  }
  spec.notes.resize(r.count());
  for (auto& n : spec.notes) {
    n.level = r.choice<NoteLevel>(3);
    n.element = r.text();
    n.text = r.text();
  }
  if (r.at != bytes.size()) r.fail("damaged");
  return spec;
}

}  // namespace linkwise
