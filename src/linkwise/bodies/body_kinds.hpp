#pragma once
// The kinds of bodies: what each answers, the table, and the dispatch. A new kind is a file like
// rigid.hpp and one line of the table. The kind of a body is known while compiling wherever it is
// asked: loops over ranges of equal bodies dispatch once per range (kinematics/kind_ranges.hpp),
// and lanes hold rigid bodies alone. All kinds with coordinates are one to them
// (coordinate_body.hpp). Which methods take which kinds is in the table of methods.
#include <concepts>
#include <cstdint>
#include <span>
#include <string>
#include <tuple>
#include <type_traits>
#include <vector>

#include "linkwise/bodies/beam.hpp"
#include "linkwise/bodies/coordinate_body.hpp"
#include "linkwise/bodies/modal.hpp"
#include "linkwise/bodies/own_coordinates.hpp"
#include "linkwise/bodies/rigid.hpp"

namespace linkwise {

/// The functions are described in rigid.hpp. Those of a motion are templates on its scalar.
template <class B>
concept BodyPorts = requires(const B& body, const RigidBody<double>& link, const Motion<double>& v,
                             const Transform<double>& X, const Vec3<double>& g,
                             ArticulatedInertia<double>& Y, const Compliance<double>& inboard,
                             const Matrix6<double>& from_inboard) {
  { B::name } -> std::convertible_to<const char*>;
  // What is wrong with finite parameters of the right number, and the remedy; or "".
  { B::fault(std::span<const double>()) } -> std::same_as<std::string>;
  { B::make(link, std::span<const double>()) } -> std::same_as<B>;
  { mass(body) } -> std::same_as<double>;
  { inertia_times(body, v) } -> std::same_as<Force<double>>;
  { momentum(body, v) } -> std::same_as<Force<double>>;
  { momentum_bias(body, v) } -> std::same_as<Force<double>>;
  { kinetic_energy(body, v) } -> std::same_as<double>;
  { potential_energy(body, X, g) } -> std::same_as<double>;
  {add_inertia(Y, body)};
  { frozen_inertia(body) } -> std::convertible_to<Inertia<double>>;
  { compliance(body) } -> std::same_as<Compliance<double>>;
  { compliance(body, inboard, X) } -> std::same_as<Matrix6<double>>;
  { compliance(body, from_inboard, X) } -> std::same_as<Matrix6<double>>;
  { moved(body, X) } -> std::same_as<B>;
  requires !has_coordinates<B> || AnswersForCoordinates<B>;
};

/// By number, the place of its line in the table.
enum class BodyKind : std::uint8_t { rigid, beam, modal };

template <class B>
struct BodyTag {
  using Body = B;
};

template <BodyPorts... Kinds>
struct BodyKindTable {
  static constexpr int size = sizeof...(Kinds);
  static constexpr const char* names[] = {Kinds::name...};
  static constexpr int n_parameters[] = {Kinds::n_parameters...};
  static constexpr bool with_coordinates[] = {Kinds::with_coordinates...};
  /// Bodies by kind.
  using Bodies = std::tuple<std::vector<Kinds>...>;

  template <class B>
  static constexpr BodyKind kind_of() {
    int i = 0;
    const bool found = ((std::is_same_v<B, Kinds> || (++i, false)) || ...);
    return found ? static_cast<BodyKind>(i) : throw "no kind of the table";
  }

  /// f(BodyTag<B>()) of the kind's type.
  template <int i = 0, class F>
  static LW_INLINE decltype(auto) dispatch(BodyKind kind, F&& f) {
    using B = std::tuple_element_t<i, std::tuple<Kinds...>>;
    if constexpr (i + 1 == size)
      return f(BodyTag<B>{});
    else
      return static_cast<int>(kind) == i ? f(BodyTag<B>{}) : dispatch<i + 1>(kind, f);
  }
  /// The same with CoordinateBody for every kind that has coordinates.
  template <int i = 0, class F>
  static LW_INLINE decltype(auto) dispatch_seen(BodyKind kind, F&& f) {
    if constexpr (i == size) {
      return f(BodyTag<CoordinateBody>{});
    } else {
      using B = std::tuple_element_t<i, std::tuple<Kinds...>>;
      if constexpr (has_coordinates<B>)
        return dispatch_seen<i + 1>(kind, f);
      else
        return static_cast<int>(kind) == i ? f(BodyTag<B>{}) : dispatch_seen<i + 1>(kind, f);
    }
  }
};

/// Rigid first. The order is that of stored models.
using BodyKinds = BodyKindTable<  //
    RigidBody<double>, Beam, ModalBody>;
static_assert(BodyKinds::kind_of<RigidBody<double>>() == BodyKind::rigid);
static_assert(BodyKinds::kind_of<Beam>() == BodyKind::beam);
static_assert(BodyKinds::kind_of<ModalBody>() == BodyKind::modal);

inline const char* body_kind_name(BodyKind kind) {
  return BodyKinds::names[static_cast<int>(kind)];
}

}  // namespace linkwise
