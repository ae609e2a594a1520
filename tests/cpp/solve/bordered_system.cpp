#include "solve/bordered_system.hpp"

namespace linkwise {

void BorderedSystem::set_border(std::span<const std::vector<int>> nodes_of_row) {
  border.assign(nodes_of_row.size(), {});
  for (std::size_t k = 0; k < border.size(); ++k)
    for (int node : nodes_of_row[k]) border[k].push_back({node});
  corner.assign(border.size() * border.size(), 0.0);
}

double BorderedSystem::border_product(int k, std::span<const double> x) const {
  double sum = 0.0;
  for (const Coupling& c : border[k])
    for (int r = 0; r < forest.dim[c.node]; ++r) sum += c.row[r] * x[forest.offset[c.node] + r];
  return sum;
}

void BorderedSystem::add_border_row(int k, double factor, std::span<double> y) const {
  for (const Coupling& c : border[k])
    for (int r = 0; r < forest.dim[c.node]; ++r) y[forest.offset[c.node] + r] += factor * c.row[r];
}

void BorderedSystem::multiply(std::span<const double> x, std::span<double> y) const {
  const std::size_t n = forest.size(), m = border.size();
  forest.multiply(x.first(n), y.first(n));
  for (std::size_t k = 0; k < m; ++k) {
    const int row = static_cast<int>(k);
    add_border_row(row, x[n + k], y);
    double sum = border_product(row, x);
    for (std::size_t l = 0; l < m; ++l) sum += corner[m * k + l] * x[n + l];
    y[n + k] = sum;
  }
}

}  // namespace linkwise
