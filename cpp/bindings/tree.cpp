// Search trees for Python.

#include "energymargin/search/tree.hpp"

#include "bindings.hpp"
#include "given.hpp"
#include "repr.hpp"

namespace energymargin::binding {

void bind_tree(py::module_& module) {
  py::class_<Tree>(module, "Tree", "All rollouts of a search as flat arrays; row 0 is the root.")
      .def_readonly("states", &Tree::states, "Shape (M + 1, n).")
      .def_readonly("costs", &Tree::costs, "Effort from the root, eq. 8, shape (M + 1,) [J].")
      .def_readonly("parents", &Tree::parents, "Row of the parent, -1 for the root, shape (M + 1,).")
      .def_readonly("controls", &Tree::controls,
                    "Wrenches that led to the node, shape (M + 1, 6 k) for k objects [N, N m].")
      .def_readonly("durations", &Tree::durations, "How long the wrenches acted, shape (M + 1,) [s].")
      .def_property_readonly("times", &Tree::times, "Since the root, shape (M + 1,) [s].")
      .def(
          "path_to", [](const Tree& tree, const Given<int>& node) { return tree.path_to(count("node", node, 0)); },
          py::arg("node"), "Rows from the root to a node, both included.")
      .def("__len__", &Tree::size)
      .def("__repr__", [](const Tree& tree) {
        return repr_of_fields("Tree",
                              {{"nodes", py::cast(tree.size() - 1)}, {"dimension", py::cast(tree.states.cols())}});
      });
}

}  // namespace energymargin::binding
