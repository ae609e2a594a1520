#pragma once
// Joints that can move something without inertia: whatever acts on them, nothing says how fast they
// speed up. Such a machine has poses, and loads of given motions, but no forward dynamics.
#include <string>
#include <vector>

#include "linkwise/graph/body_tree.hpp"
#include "linkwise/model/lumped_inertia.hpp"
#include "linkwise/model/machine.hpp"

namespace linkwise {

/// All such links and joints in one line with its remedy, or "". Notes warn of each.
///
/// A joint is one of them if all that hangs on it is massless, or if it ends in a single body
/// without inertia about an axis that the joint turns; unless it has armature, or its motion is
/// given. So are joints in a row with massless links between them and more than six degrees of
/// freedom that have none.
std::string find_undetermined(const Machine& machine, const Lumps& lumps,
                              const LumpedInertia& lumped, std::vector<Note>& notes);

}  // namespace linkwise
