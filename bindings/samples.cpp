#include "samples.hpp"

namespace linkwise::bindings {

Columns::Columns(const Model& model, const Shape& lead, nb::handle wanted) {
  const auto table = quantity_table();
  for (size_t k = 0; k < table.size(); ++k) {
    const QuantityEntry& entry = table[k];
    const std::string group(entry.group), name(entry.name);
    if (!wanted.is_none() && !nb::cast<bool>(wanted.attr("__contains__")(group))) continue;
    if (entry.count) {
      nb::object array = numpy("empty")(to_tuple(lead), "dtype"_a = "int64");
      sample.counts[k] =
          reinterpret_cast<std::int64_t*>(reinterpret_cast<NumpyArray*>(array.ptr())->data);
      arrays.emplace_back(name, std::move(array));
      continue;
    }
    const bool wrench = entry.axis == Axis::joints || entry.axis == Axis::bodies;
    Shape tail;
    if (wrench) tail = {quantity_width(entry, model) / 6, 6};
    if (!wrench && entry.axis != Axis::none) tail = {quantity_width(entry, model)};
    const NewArray made(lead, tail);
    sample.values[k] = made.data;
    arrays.emplace_back(name, made.array);
  }
}

nb::dict Columns::to_python(size_t n) const {
  nb::dict out;
  const nb::slice head(nb::int_(0), nb::int_(n), nb::int_(1));
  for (const auto& [name, array] : arrays) out[name.c_str()] = array[head];
  return out;
}

}  // namespace linkwise::bindings
