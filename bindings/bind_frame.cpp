// Frame: a point with axes on a link; and where frames are on a model.
#include <cmath>
#include <functional>

#include <nanobind/nanobind.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/tuple.h>

#include "bind.hpp"
#include "frame.hpp"
#include "linkwise/model/validate.hpp"
#include "numbers.hpp"
#include "printable.hpp"
#include "vectors.hpp"

namespace linkwise::bindings {
namespace {

/// Turns by roll about x, pitch about y, yaw about z, all of them the link's axes, in this order:
/// columns are the turned axes, as in URDF.
Mat3<double> from_rpy(const double* rpy) {
  const double cr = std::cos(rpy[0]), sr = std::sin(rpy[0]), cp = std::cos(rpy[1]),
               sp = std::sin(rpy[1]), cy = std::cos(rpy[2]), sy = std::sin(rpy[2]);
  return {{cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr, sy * cp, sy * sp * sr + cy * cr,
           sy * sp * cr - cy * sr, -sp, cp * sr, cp * cr}};
}

/// The frame's axes as columns, in the link's components.
Mat3<double> axes_of(nb::handle value) {
  const ArrayIn a = as_array(value, "axes");
  const Shape shape = shape_of(a);
  if (shape == Shape{3, 3}) return mat3(value, "axes");
  for (size_t i = 0; i < a.size(); ++i)
    if (!std::isfinite(a.data()[i])) throw InputError("axes are not finite; give finite numbers");
  if (shape == Shape{3}) return from_rpy(a.data());
  if (shape != Shape{4})
    throw InputError("axes has shape " + shape_text(shape) +
                     "; give roll, pitch, yaw, a quaternion x, y, z, w, or a 3x3 rotation matrix");
  const double* p = a.data();
  const double length = std::sqrt(p[0] * p[0] + p[1] * p[1] + p[2] * p[2] + p[3] * p[3]);
  if (!(std::abs(length - 1) <= 1e-3))
    throw InputError("axes: the quaternion x, y, z, w has not length 1; give a unit quaternion");
  return transpose(rotation_to_child(p));
}

Frame make_frame(std::string link, nb::handle origin, nb::handle axes) {
  Frame frame{std::move(link)};
  if (!origin.is_none()) frame.placement.r = vec3(origin, "origin");
  if (!axes.is_none()) frame.placement.R = transpose(axes_of(axes));
  const Vec3<double>& r = frame.placement.r;
  if (!std::isfinite(r.x + r.y + r.z))
    throw InputError("origin is not finite; give three finite numbers in m");
  require_rotation(frame.placement.R, "axes");
  return frame;
}

bool is_turned(const Frame& frame) {
  const Mat3<double> none = Mat3<double>::identity();
  return !std::equal(none.m, none.m + 9, frame.placement.R.m);
}

std::string number(double value) {
  return nb::cast<std::string>(nb::str(nb::repr(nb::float_(value + 0.0))));
}

bool same(const Frame& a, const Frame& b) {
  const Transform<double>&x = a.placement, &y = b.placement;
  return a.link == b.link && x.r.x == y.r.x && x.r.y == y.r.y && x.r.z == y.r.z &&
         std::equal(x.R.m, x.R.m + 9, y.R.m);
}

size_t hash(const Frame& frame) {
  size_t h = std::hash<std::string>{}(frame.link);
  const auto add = [&h](double x) { h = 31 * h + std::hash<double>{}(x + 0.0); };
  for (double x : {frame.placement.r.x, frame.placement.r.y, frame.placement.r.z}) add(x);
  for (double x : frame.placement.R.m) add(x);
  return h;
}

nb::object matrix(const Mat3<double>& m) {
  NewArray out({3}, {3});
  std::copy(m.m, m.m + 9, out.data);
  return read_only(out.array);
}

nb::object origin_of(const Frame& frame) {
  const Vec3<double>& r = frame.placement.r;
  return read_only(to_numpy({r.x, r.y, r.z}));
}

nb::tuple placement_of(const PyModel& self, nb::handle value) {
  const FramePlacement at = place_frame(*self.model, as_frame(value));
  const nb::object body = at.joint < 0
                              ? nb::none()
                              : nb::cast(self.model->links[self.model->joints[at.joint].link].name);
  const Vec3<double>& r = at.placement.r;
  return nb::make_tuple(body, matrix(transpose(at.placement.R)),
                        read_only(to_numpy({r.x, r.y, r.z})));
}

}  // namespace

Frame as_frame(nb::handle value) {
  if (nb::isinstance<nb::str>(value)) return {name_in(value, "frame")};
  if (nb::isinstance<Frame>(value)) return nb::cast<Frame>(value);
  throw InputError("frame is " + nb::cast<std::string>(nb::str(nb::repr(value))) +
                   "; give the name of a link, or a linkwise.Frame");
}

std::string frame_text(const Frame& frame) {
  const Vec3<double>& r = frame.placement.r;
  std::string text = "Frame('" + frame.link + "'";
  if (r.x != 0 || r.y != 0 || r.z != 0)
    text += ", origin=(" + number(r.x) + ", " + number(r.y) + ", " + number(r.z) + ")";
  if (is_turned(frame)) {
    text += ", axes=[";
    for (int i = 0; i < 9; ++i)
      text += std::string(i % 3 ? ", "
                          : i   ? ", ["
                                : "[") +
              number(frame.placement.R.m[3 * (i % 3) + i / 3]) + (i % 3 == 2 ? "]" : "");
    text += "]";
  }
  return text + ")";
}

void bind_frame(nb::module_& m) {
  nb::class_<Frame>(
      m, "Frame",
      "A point with axes on a link: where wrenches act, and where poses, velocities, Jacobians and "
      "loads are\n"
      "asked for. The name of a link alone, a merged one's too, stands for the link's own frame.")
      .def(
          "__init__",
          [](Frame* self, std::string link, nb::handle origin, nb::handle axes) {
            new (self) Frame(make_frame(std::move(link), origin, axes));
          },
          "link"_a, "origin"_a = nb::none(), "axes"_a = nb::none(),
          R"(A frame on a link.

Args:
    link: its name.
    origin: (3,) [m], in the link's frame; None: its origin.
    axes: roll, pitch, yaw (3,) [rad] as in URDF, a quaternion x, y, z, w (4,), or a rotation matrix
        (3, 3) whose columns are the frame's axes, in the link's frame; None: parallel to it.

Raises:
    InputError: a shape is wrong, a number is not finite, or axes are no rotation.)")
      .def_prop_ro(
          "link", [](const Frame& f) { return f.link; }, "The name of the link that carries it.")
      .def_prop_ro("origin", &origin_of, "Its origin (3,) [m], in the link's frame.")
      .def_prop_ro(
          "axes", [](const Frame& f) { return read_only(matrix(transpose(f.placement.R))); },
          "Its axes (3, 3) [unit vectors] as columns, in the link's frame.")
      .def("__repr__", [](const Frame& f) { return printable(frame_text(f)); })
      .def("__eq__",
           [](const Frame& f, nb::handle other) {
             return nb::isinstance<Frame>(other) && same(f, nb::cast<Frame>(other));
           })
      .def("__hash__", &hash)
      .def("__getstate__",
           [](const Frame& f) {
             return nb::make_tuple(f.link, origin_of(f), matrix(transpose(f.placement.R)));
           })
      .def("__setstate__", [](Frame& f, const nb::tuple& state) {
        new (&f) Frame(make_frame(name_in(state[0], "frame"), state[1], state[2]));
      });
}

void bind_frame_placement(nb::class_<PyModel>& c) {
  c.def("frame_placement", &placement_of, "frame"_a,
        R"(Where a frame is on the moving body that carries it.

Args:
    frame: a link's name, merged or not, or a Frame.

Returns:
    (body, R, p): the body, by the name of its joint's child link, None for the ground; the
    frame's axes R (3, 3) [unit vectors] as columns and its origin p (3,) [m], in the body's frame, or the
    world's at the ground.

Raises:
    InputError: the link is unknown.)");
}

}  // namespace linkwise::bindings
