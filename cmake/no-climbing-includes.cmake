# Fails when a source file includes by a path that climbs ("../") or starts at the root of the file system.
file(GLOB_RECURSE files ${ROOT}/protocol/*.[ch]pp ${ROOT}/board/*.[ch]pp ${ROOT}/drivers/*.[ch]pp
     ${ROOT}/firmware/*.[ch]pp ${ROOT}/tools/*.[ch]pp ${ROOT}/host-tests/*.[ch]pp)
set(found "")
foreach(file IN LISTS files)
  file(STRINGS ${file} lines REGEX "^[ \t]*#[ \t]*include[ \t]*[<\"](\\.\\./|/|.*/\\.\\./)")
  foreach(line IN LISTS lines)
    string(APPEND found "  ${file}: ${line}\n")
  endforeach()
endforeach()
if(found)
  message(FATAL_ERROR "An include must name its room from the top:\n${found}")
endif()
