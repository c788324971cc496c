# SPDX-License-Identifier: Apache-2.0
# cmake -DIN=FILE -DOUT=FILE.cpp -DHEADER=HEADER -DNAMESPACE=NAMESPACE -DNAME=kName -P embed.cmake
# Writes a C++ source that defines NAME, declared in HEADER, as what the file holds.
file(READ "${IN}" text)
if(text MATCHES "\\)embedded\"")
  message(FATAL_ERROR "${IN} holds )embedded\", which ends the C++ literal that it becomes")
endif()
get_filename_component(file "${IN}" NAME)
file(WRITE "${OUT}" "// Made of ${file}.
#include \"${HEADER}\"
namespace ${NAMESPACE} {
const char* const ${NAME} = R\"embedded(${text})embedded\";
}
")
