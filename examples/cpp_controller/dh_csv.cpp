#include "dh_csv.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <locale>
#include <map>
#include <regex>
#include <sstream>
#include <stdexcept>

namespace fk {
namespace {

using Cells = std::vector<std::string>;

Cells split(const std::string& line) {
  Cells cells;
  std::istringstream in(line + ',');  // so that an empty last cell counts
  for (std::string cell; std::getline(in, cell, ',');) {
    const auto first = cell.find_first_not_of(" \t\r");
    cells.push_back(first == cell.npos ? "" : cell.substr(first, cell.find_last_not_of(" \t\r") - first + 1));
  }
  return cells;
}

Cells parse_header(const std::string& line) {
  static const Cells known{"joint", "type", "a", "alpha", "d", "theta"};
  Cells columns = split(line);
  for (std::string& column : columns) {
    if (column == "name") column = "joint";
    if (column == "theta_offset") column = "theta";
    if (std::count(known.begin(), known.end(), column) == 0)
      throw std::invalid_argument("unknown column '" + column + "', expected joint,type,a,alpha,d,theta");
  }
  for (const std::string& column : known) {
    const auto count = std::count(columns.begin(), columns.end(), column);
    if (count > 1) throw std::invalid_argument("column '" + column + "' is there twice");
    if (count == 0 && column != "type" && column != "theta")
      throw std::invalid_argument("column '" + column + "' is missing");
  }
  return columns;
}

DHJoint parse_row(const Cells& columns, const Cells& cells, Convention convention) {
  static const std::map<std::string, JointType> types{{"", JointType::revolute}, {"revolute", JointType::revolute},
                                                      {"prismatic", JointType::prismatic}, {"fixed", JointType::fixed}};
  if (cells.size() != columns.size())
    throw std::invalid_argument("expected " + std::to_string(columns.size()) + " cells, got " + std::to_string(cells.size()));
  std::map<std::string, std::string> cell;
  for (std::size_t i = 0; i < cells.size(); ++i) cell[columns[i]] = cells[i];
  if (cell["joint"].empty()) throw std::invalid_argument("expected a joint name, got an empty cell");
  const auto type = types.find(cell["type"]);
  if (type == types.end())
    throw std::invalid_argument("unknown joint type '" + cell["type"] + "', expected revolute, prismatic or fixed");
  const auto number = [&](const char* column) { return cell[column].empty() ? 0.0 : parse_number(cell[column]); };
  return {cell["joint"], type->second, number("a"), number("alpha"), number("d"), number("theta"), convention};
}

}  // namespace

double parse_number(const std::string& text) {
  std::istringstream in(text);
  in.imbue(std::locale::classic());  // strtod would read 0.5 as 0 where the decimal point is a comma
  double value = 0.0;
  if ((in >> value) && in.peek() == std::istringstream::traits_type::eof() && std::isfinite(value)) return value;

  static const std::regex multiple_of_pi(R"(([+-]?)\s*(?:([1-9]\d*)\s*\*\s*)?pi(?:\s*/\s*([1-9]\d*))?)");
  std::smatch match;
  if (text.size() > 64 || !std::regex_match(text, match, multiple_of_pi))  // std::regex recurses: short texts only
    throw std::invalid_argument("expected a number or a multiple of pi such as pi/2 or 3*pi/4, got '" + text + "'");
  const double times = match[2].matched ? std::stod(match[2]) : 1.0;
  const double over = match[3].matched ? std::stod(match[3]) : 1.0;
  return (match[1] == "-" ? -1.0 : 1.0) * times * std::acos(-1.0) / over;
}

Eigen::Isometry3d parse_pose(const std::string& text) {
  std::istringstream in(text);
  const Cells numbers{std::istream_iterator<std::string>(in), {}};
  if (numbers.size() != 6) throw std::invalid_argument("expected six numbers 'x y z roll pitch yaw', got '" + text + "'");
  double v[6];
  std::transform(numbers.begin(), numbers.end(), v, parse_number);
  return Eigen::Translation3d(v[0], v[1], v[2]) * Eigen::AngleAxisd(v[5], Eigen::Vector3d::UnitZ()) *
         Eigen::AngleAxisd(v[4], Eigen::Vector3d::UnitY()) * Eigen::AngleAxisd(v[3], Eigen::Vector3d::UnitX());
}

std::vector<DHJoint> read_dh_csv(std::istream& in, const std::string& where, Convention convention) {
  std::vector<DHJoint> rows;
  Cells columns;
  int number = 0;
  try {
    for (std::string line; std::getline(in, line);) {
      if (++number == 1 && line.rfind("\xEF\xBB\xBF", 0) == 0) line.erase(0, 3);  // byte order mark
      line.erase(std::min(line.find('#'), line.size()));
      if (line.find_first_not_of(" \t\r,") == line.npos) continue;
      if (line.find('"') != line.npos) throw std::invalid_argument("quoted cells are not supported");
      if (columns.empty()) {
        columns = parse_header(line);
        continue;
      }
      rows.push_back(parse_row(columns, split(line), convention));
      for (auto row = rows.begin(); row + 1 != rows.end(); ++row)
        if (row->name == rows.back().name) throw std::invalid_argument("duplicate joint '" + row->name + "'");
    }
    if (rows.empty()) throw std::invalid_argument("expected a header and at least one row, got none");
  } catch (const std::invalid_argument& error) {
    throw std::runtime_error(where + ":" + std::to_string(number) + ": " + error.what());
  }
  return rows;
}

}  // namespace fk
