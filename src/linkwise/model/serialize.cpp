// A ModelSpec as a flat byte string: plain numbers in the machine's order, counts as 64-bit
// integers. One function names what is stored and in which order; an archive writes or reads it.
#include <algorithm>
#include <cstdint>
#include <cstring>
#include <type_traits>
#include <utility>

#include "linkwise/base/error.hpp"
#include "linkwise/model/spec.hpp"

namespace linkwise {
namespace {

// Machines without loops are described as they always were, where what is as usual may be left out
// at the end. Others are described in full, so that bytes cut short are no other machine.
// So are those with bearings, whose list stands last, and those whose bearings do not fit.
constexpr const char* magics[] = {"linkwise-model-1", "linkwise-model-2", "linkwise-model-3",
                                  "linkwise-model-4"};
constexpr int in_full = 1, with_bearings = 2, with_misfits = 3;

struct Writer {
  std::string bytes;
  int extent;

  explicit Writer(int of) : bytes(magics[of]), extent(of) {}

  void raw(const void* data, size_t n) { bytes.append(static_cast<const char*>(data), n); }
  template <class E>
  void choice(E value, int) {
    raw(&value, sizeof(E));
  }
  template <class V>
  void size(const V& values) {
    const std::uint64_t n = values.size();
    raw(&n, sizeof(n));
  }
  bool goes_on(bool more) const { return more || extent >= in_full; }
};

struct Reader {
  const std::string& bytes;
  int extent;
  size_t at = std::strlen(magics[0]);

  Reader(const std::string& given, int of) : bytes(given), extent(of) {}

  [[noreturn]] static void fail(const char* what) {
    throw InputError(std::string("model data is ") + what +
                     "; it was not written by this version of linkwise");
  }
  void raw(void* out, size_t n) {
    if (n > bytes.size() - at) fail("cut short");
    if (n == 0) return;  // `out` may be null: an empty vector's
    std::memcpy(out, bytes.data() + at, n);
    at += n;
  }
  /// An enumeration of n values, or a truth value: anything else would be read out of bounds later.
  template <class E>
  void choice(E& value, int n) {
    std::conditional_t<sizeof(E) == 1, unsigned char, int> x{};
    static_assert(sizeof(x) == sizeof(E));
    raw(&x, sizeof(x));
    if (x < 0 || x >= n) fail("damaged");
    value = static_cast<E>(x);
  }
  template <class V>
  void size(V& values) {
    std::uint64_t n = 0;
    raw(&n, sizeof(n));
    if (n > bytes.size() - at) fail("cut short");
    values.resize(n);
  }
  bool goes_on(bool) const { return extent >= in_full || at < bytes.size(); }
};

template <class A, class Text>
void text(A& archive, Text& s) {
  archive.size(s);
  archive.raw(s.data(), s.size());
}

template <class A, class Joint>
void joint_fields(A& archive, Joint& j) {
  text(archive, j.name);
  archive.choice(j.type, n_joint_types);
  text(archive, j.parent);
  text(archive, j.child);
  archive.raw(j.rotation.m, sizeof(j.rotation.m));
  archive.raw(&j.translation.x, 3 * sizeof(double));
  archive.size(j.axes);
  for (auto& a : j.axes) {
    archive.choice(a.kind, 3);
    archive.raw(&a.axis.x, 3 * sizeof(double));
    archive.raw(&a.pitch, sizeof(double));
  }
  archive.size(j.dof);
  for (auto& d : j.dof) {
    archive.choice(d.property, n_dof_properties);
    archive.size(d.values);
    archive.raw(d.values.data(), d.values.size() * sizeof(double));
  }
}

template <class A, class Spec>
void spec_fields(A& archive, Spec& spec) {
  text(archive, spec.name);
  text(archive, spec.source);
  archive.raw(&spec.gravity.x, 3 * sizeof(double));
  archive.choice(spec.floating_base, 2);
  text(archive, spec.floating_joint);
  archive.choice(spec.keep_fixed, 2);
  archive.size(spec.prescribed);
  for (auto& name : spec.prescribed) text(archive, name);
  archive.size(spec.links);
  for (auto& l : spec.links) {
    text(archive, l.name);
    archive.raw(&l.mass, sizeof(double));
    archive.raw(&l.com.x, 3 * sizeof(double));
    archive.raw(l.inertia.m, sizeof(l.inertia.m));
  }
  archive.size(spec.joints);
  for (auto& j : spec.joints) joint_fields(archive, j);
  archive.size(spec.notes);
  for (auto& n : spec.notes) {
    archive.choice(n.level, 3);
    text(archive, n.element);
    text(archive, n.text);
  }
  // Each of these is left out where nothing follows that is not as usual, so that other machines
  // are described as they always were.
  const bool kinds = std::any_of(spec.links.begin(), spec.links.end(),
                                 [](const LinkSpec& l) { return l.body_kind != BodyKind::rigid; });
  const bool starts = std::any_of(spec.joints.begin(), spec.joints.end(),
                                  [](const JointSpec& j) { return !j.initial.empty(); });
  if (!archive.goes_on(starts || kinds)) return;
  for (auto& j : spec.joints) {
    archive.size(j.initial);
    archive.raw(j.initial.data(), j.initial.size() * sizeof(double));
  }
  if (!archive.goes_on(kinds)) return;
  for (auto& l : spec.links) {
    archive.choice(l.body_kind, BodyKinds::size);
    archive.size(l.parameters);
    archive.raw(l.parameters.data(), l.parameters.size() * sizeof(double));
  }
  if (archive.extent < in_full) return;
  archive.size(spec.loop_joints);
  for (auto& loop : spec.loop_joints) {
    joint_fields(archive, loop.joint);
    archive.size(loop.joint.initial);
    archive.raw(loop.joint.initial.data(), loop.joint.initial.size() * sizeof(double));
    archive.raw(loop.child_rotation.m, sizeof(loop.child_rotation.m));
    archive.raw(&loop.child_translation.x, 3 * sizeof(double));
    archive.choice(loop.kind, n_loop_kinds);
    archive.raw(&loop.length, sizeof(double));
  }
  archive.size(spec.couplings);
  for (auto& coupling : spec.couplings) {
    text(archive, coupling.name);
    archive.size(coupling.terms);
    for (auto& term : coupling.terms) {
      text(archive, term.joint);
      archive.raw(&term.factor, sizeof(double));
      archive.raw(term.higher, sizeof(term.higher));
    }
    archive.raw(&coupling.offset, sizeof(double));
  }
  if (archive.extent < with_bearings) return;
  archive.size(spec.bearings);
  for (auto& bearing : spec.bearings) {
    text(archive, bearing.joint);
    for (auto* x : {&bearing.radial, &bearing.axial, &bearing.tilt, &bearing.torsion})
      archive.raw(x, sizeof(double));
    archive.raw(&bearing.axis.x, 3 * sizeof(double));
    if (archive.extent < with_misfits) continue;
    for (auto* x : {&bearing.offset, &bearing.turn, &bearing.preload})
      archive.raw(&x->x, 3 * sizeof(double));
    for (auto* x : {&bearing.offset_along, &bearing.preload_along}) archive.raw(x, sizeof(double));
  }
}

}  // namespace

std::string serialize(const ModelSpec& spec) {
  const bool loops = !spec.loop_joints.empty() || !spec.couplings.empty();
  const bool misfits = std::any_of(spec.bearings.begin(), spec.bearings.end(),
                                   [](const BearingSpec& bearing) { return bearing.has_misfit(); });
  Writer writer(misfits                  ? with_misfits
                : !spec.bearings.empty() ? with_bearings
                : loops                  ? in_full
                                         : 0);
  spec_fields(writer, spec);
  return std::move(writer.bytes);
}

ModelSpec deserialize(const std::string& bytes) {
  int extent = with_misfits;
  while (extent >= 0 && !bytes.starts_with(magics[extent])) --extent;
  if (extent < 0)
    throw InputError(
        "model data was not written by this version of linkwise; build the model again from its "
        "source");
  Reader reader(bytes, extent);
  ModelSpec spec;
  spec_fields(reader, spec);
  if (reader.at != bytes.size()) Reader::fail("damaged");
  return spec;
}

}  // namespace linkwise
