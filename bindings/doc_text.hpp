#pragma once
// Docstrings of functions of states. What several of them say is written once.
#include <initializer_list>
#include <string>

namespace linkwise::bindings::doc {

inline constexpr const char* model = "    model: the machine.\n";
inline constexpr const char* q = "    q: positions (..., nq) [rad, m].\n";
inline constexpr const char* q_v =
    "    q: positions (..., nq) [rad, m]; v: rates (..., nv) [rad/s, m/s]. Leading axes "
    "broadcast.\n";
inline constexpr const char* q_v_tau =
    R"(    q: positions (..., nq) [rad, m]; v: rates (..., nv) [rad/s, m/s], None: at rest;
        tau: joint torques and forces (..., nv) [N m, N], None: zero. Leading axes broadcast.
)";
inline constexpr const char* q_v_acceleration =
    R"(    q: positions (..., nq) [rad, m]; v: rates (..., nv) [rad/s, m/s], None: at rest;
        acceleration: dv/dt (..., nv) [rad/s2, m/s2], None: zero. Leading axes broadcast.
)";
inline constexpr const char* external =
    R"(    external: wrenches (..., n_joints, 6) [N, N m] on the joints' child links, each at its joint
        point, in its joint frame, force first; None: no wrench.
)";
inline constexpr const char* loop_tau =
    R"(    loop_tau: torques and forces of the joints that close loops (..., sum of their nv) [N m, N], in
        the order of model.loop_slices; None: none.
)";
inline constexpr const char* passive =
    "    passive: adds the model's damping, friction, springs and stops to tau.\n";
inline constexpr const char* gravity =
    "    gravity: factor on the model's gravity, 0 leaves it out.\n";
inline constexpr const char* prescribed =
    R"(    prescribed: accelerations (..., nv) of the joints of Model.prescribe; the others are not read.
)";
inline constexpr const char* loop_prescribed =
    R"(    loop_prescribed: accelerations (..., sum of their nv) of the joints that close loops, of which those of
        Model.prescribe are read; None: zero.
)";
inline constexpr const char* frame = "    frame: a link's name, merged or not, or a Frame.\n";
inline constexpr const char* threads =
    R"(    threads: how many share the states; None: LINKWISE_THREADS or all cores. No bit depends on it.
)";
inline constexpr const char* unfit = "shapes do not fit the model, or a number is not finite.";
inline constexpr const char* unknown_link =
    "the link is unknown, shapes do not fit the model, or a number is not finite.";

/// Of a function of a model: its other arguments in whole lines, threads last.
inline std::string text(const char* title, std::initializer_list<const char*> arguments,
                        const char* returns, const char* input_error = unfit) {
  std::string text = std::string(title) + "\n\nArgs:\n" + model;
  for (const char* argument : arguments) text += argument;
  return text + threads + "\nReturns:\n" + returns + "\n\nRaises:\n    InputError: " + input_error;
}

}  // namespace linkwise::bindings::doc
