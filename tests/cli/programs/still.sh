# A program that never moves, with more commands of a test: at the START it knows the folder, the seed, the settings and
# the start's markers; at a FRAME it may answer itself, as by `lost`, and go on with the next.
read -r hello
seed=${hello#*'"seed":'} seed=${seed%%[!0-9]*}
folder=${hello#*'"folder":"'} folder=${folder%%'"'*}
case $hello in *'"settings":'*) settings=${hello#*'"settings":'} settings=${settings%%\}*}\} ;; esac
markers=${hello#*'"start":'} markers=${markers#*'"markers":'} markers=${markers%%\}*}\}
lost() { echo "{\"type\":\"lost\",\"frame\":$frame}"; }
: START
echo '{"type":"ready","name":"still"}'
while read -r told; do
    case $told in *'"type":"end"'*) exit ;; esac
    frame=${told#*'"frame":'} frame=${frame%%,*}
    : FRAME
    echo "{\"type\":\"pose\",\"frame\":$frame,\"markers\":$markers}"
done
