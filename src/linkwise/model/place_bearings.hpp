#pragma once
// What joints yield to their loads.
#include "linkwise/model/model.hpp"

namespace linkwise {

/// Of a model that is complete otherwise; warns where they decide nothing. Throws InputError where
/// a bearing names a joint that does not exist or holds nothing, or yields where the joint moves
/// freely.
std::vector<Bearing> place_bearings(const Model& model, std::vector<Note>& notes);

}  // namespace linkwise
