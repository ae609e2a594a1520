#include "linkwise/model/place_couplings.hpp"

#include <algorithm>
#include <cmath>
#include <set>

#include "linkwise/base/error.hpp"
#include "linkwise/model/validate.hpp"

namespace linkwise {
namespace {

std::string type_of(const Model& model, int load) {
  const bool rod =
      load >= model.n_joints() && model.loops.joints[load - model.n_joints()].kind == LoopKind::rod;
  return rod ? "a rod" : joint_type_name(model.joint_at(load).type);
}

Coupling::Term place_term(const Model& model, const CouplingSpec::Term& given,
                          const std::string& head) {
  int j = -1;
  try {
    j = model.load_index(given.joint);
  } catch (const InputError& error) {
    throw InputError(head + error.what());
  }
  const JointInfo& joint = model.joint_at(j);
  if (joint.type == JointType::elastic)
    throw InputError(head + "joint '" + joint.name +
                     "' is elastic, and its coordinates are not coupled; couple other joints");
  if (joint.nv != 1)
    throw InputError(head + "joint '" + joint.name + "' is " + type_of(model, j) + " and has " +
                     std::to_string(joint.nv) + " degrees of freedom; couple joints that have one");
  bool moves = given.factor != 0, finite = std::isfinite(given.factor);
  for (const double c : given.higher) {
    moves |= c != 0;
    finite &= std::isfinite(c);
  }
  if (!finite || !moves)
    throw InputError(head + "the factor of joint '" + joint.name + "' is " +
                     number_text(given.factor) + "; give a finite number other than 0");
  Coupling::Term term{j, joint.body, joint.q, joint.v, given.factor};
  std::copy_n(given.higher, 3, term.higher);
  term.closes = j >= model.n_joints();
  return term;
}

}  // namespace

std::vector<Coupling> place_couplings(const Model& model) {
  std::vector<Coupling> out;
  std::set<std::string> names;
  for (const CouplingSpec& given : model.spec().couplings) {
    if (given.name.empty())
      throw InputError("a coupling" + model.where() + " has an empty name; give every one a name");
    const std::string head = "coupling '" + given.name + "'" + model.where() + ": ";
    if (!names.insert(given.name).second)
      throw InputError(head + "the name is used twice; rename one of them");
    if (!std::isfinite(given.offset))
      throw InputError(head + "offset is not finite; give a finite number");
    Coupling coupling{given.name, {}, given.offset};
    std::set<std::string> joints;
    bool moves = false;
    for (const CouplingSpec::Term& term : given.terms) {
      if (!joints.insert(term.joint).second)
        throw InputError(head + "joint '" + term.joint + "' is named twice; add its factors up");
      coupling.terms.push_back(place_term(model, term, head));
      const Coupling::Term& placed = coupling.terms.back();
      const JointInfo& joint = model.joint_at(placed.joint);
      const auto& elements = placed.closes ? model.loops.elements : model.elements;
      moves |= !elements[joint.first_element].prescribed;
    }
    if (coupling.terms.empty())
      throw InputError(head + "names no joint; give each joint its factor");
    if (!moves)
      throw InputError(head +
                       "the motion of all its joints is given; leave one of them free, or remove "
                       "the coupling");
    out.push_back(std::move(coupling));
  }
  return out;
}

}  // namespace linkwise
