package Estimation "State estimators"
end Estimation;
