// fk_worker: serves the forward kinematics of a DH table. To connect another controller, this is the file to write anew.
#include <fstream>
#include <iostream>
#include <stdexcept>

#include "dh_csv.hpp"
#include "protocol.hpp"

namespace {

const std::string USAGE =
    R"(usage: fk_worker DH.csv [--convention standard|modified] [--base "x y z r p y"] [--tool "x y z r p y"])";

fk::DHChain chain_from(const std::vector<std::string>& arguments) {
  if (arguments.size() % 2 == 0) throw std::invalid_argument(USAGE);  // the file, then options with a value each
  fk::DHChain chain;
  auto convention = fk::Convention::standard;
  for (std::size_t i = 1; i < arguments.size(); i += 2) {
    const std::string &option = arguments[i], &value = arguments[i + 1];
    if (option == "--base")
      chain.T_base_0 = fk::parse_pose(value);
    else if (option == "--tool")
      chain.T_n_tool = fk::parse_pose(value);
    else if (option == "--convention" && (value == "standard" || value == "modified"))
      convention = value == "modified" ? fk::Convention::modified : fk::Convention::standard;
    else
      throw std::invalid_argument("unexpected '" + option + " " + value + "'; " + USAGE);
  }
  std::ifstream file(arguments[0]);
  if (!file) throw std::runtime_error(arguments[0] + ": cannot be read");
  chain.rows = fk::read_dh_csv(file, arguments[0], convention);
  return chain;
}

}  // namespace

int main(int argc, char** argv) {
  std::ios::sync_with_stdio(false);
  try {
    const fk::DHChain chain = chain_from({argv + 1, argv + argc});
    const auto placements = [&](const auto& q, auto& T_base_frame) { chain.placements(q, T_base_frame); };
    return fk::serve({"fk_worker", chain.joints(), chain.frames(), {{"eigen", EIGEN3_VERSION}}, placements}, std::cin, std::cout);
  } catch (const std::exception& error) {
    return fk::refuse(error.what(), std::cin, std::cout);
  }
}
