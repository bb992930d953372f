within Fleet;
block DeckForecast "Forecast of a component of the deck's velocity up to 2 s ahead by an autoregressive model, with its error statistics"
  parameter Real forgetting(unit = "1", min = 0.9, max = 1) = 0.998 "Weight of the past per step of 0.2 s";
  parameter Real statistics_time(unit = "s", min = 1) = 20 "Memory of the error statistics";
  input Real u(start = 0, unit = "m/s") "Velocity";
  output Real forecast[10](each start = 0, each unit = "m/s") "Velocity 0.2, 0.4, ..., 2 s after the latest sample";
  output Real acceleration[10](each start = 0, each unit = "m/s2") "Mean in each step of the forecast";
  output Integer age(start = 0) "Sample periods since the latest sample";
  output Real error_rms(start = 0, unit = "m/s") "Of the forecasts of 2 s";
  output Real usual_rms(start = 0, unit = "m/s") "Of the velocity itself";
protected
  pure function update "Update the model by a sample"
    input Real state[100];
    input Real u;
    input Real forgetting;
    output Real next[100];
  external "C" ar_update(state, u, forgetting, next) annotation(Include = "#include \"ar_forecast.h\"");
  end update;

  constant Integer ticks = 20 "Of a step";
  final parameter Real slow = 1 - exp(-ticks*sample_period/statistics_time);
  discrete Integer tick(start = 0, fixed = true);
  discrete Integer samples(start = 0, fixed = true);
  discrete Real state[100](start = {if i <= 64 and mod(i - 1, 9) == 0 then 100.0 else 0.0 for i in 1:100}, each fixed = true);
  discrete Real due(start = 0, fixed = true) "Forecast for this sample, 2 s old";
  discrete Real error_power(start = 0, fixed = true);
  discrete Real usual_power(start = 0, fixed = true);
algorithm
  when sample(0, sample_period) then
    age := if pre(samples) == 0 or pre(tick) == ticks - 1 then 0 else pre(age) + 1;
    tick := age;
    state := pre(state);
    if age == 0 then
      due := state[100];
      state := update(pre(state), u, forgetting);
      samples := pre(samples) + 1;
      if samples > 30 then
        error_power := pre(error_power) + slow*((u - due)^2 - pre(error_power));
        usual_power := pre(usual_power) + slow*(u^2 - pre(usual_power));
      end if;
    end if;
    forecast := state[81:90];
    acceleration := (forecast - cat(1, state[73:73], forecast[1:9]))/0.2;
    error_rms := sqrt(error_power);
    usual_rms := sqrt(usual_power);
  end when;
end DeckForecast;
