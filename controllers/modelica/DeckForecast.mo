block DeckForecast "Forecast of a deck's velocity up to 2 s ahead by an autoregressive model, with its error statistics"
  extends Fleet.DeckForecast;
end DeckForecast;
